import { definePageCases } from "./page-cases";

definePageCases("Firefox");
