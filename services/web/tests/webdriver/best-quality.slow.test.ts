import { defineSlowCases } from "./page-cases";
import { describeInWebDriver } from "./webdriver-suite";

describeInWebDriver("Firefox", defineSlowCases);
describeInWebDriver("WebKitGTK", defineSlowCases);
