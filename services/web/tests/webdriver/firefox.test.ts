import { definePageCases } from "./page-cases";
import { describeInWebDriver } from "./webdriver-suite";

describeInWebDriver("Firefox", definePageCases);
