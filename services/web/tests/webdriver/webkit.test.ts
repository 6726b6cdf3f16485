import { definePageCases } from "./page-cases";

definePageCases("WebKitGTK");
