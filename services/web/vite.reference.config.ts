/** Build of the reference page of the HTTP API, which the server answers at /v1/docs. */
import { defineConfig } from "vite";
import { additionalBuild } from "./vite.additional.ts";

export default defineConfig(additionalBuild({ input: { reference: "v1/docs.html" } }));
