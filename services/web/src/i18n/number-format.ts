/** Numbers in the page's language. Pure. */
import { pageLanguage } from "./translator";

/** With so many digits after the point, neither more nor fewer. */
export function formatDecimal(value: number, digits: number): string {
  return new Intl.NumberFormat(pageLanguage(), {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: "min2",
    signDisplay: "negative",
  }).format(value);
}

/** A share, 0 to 1, in whole hundredths. */
export function formatPercent(fraction: number): string {
  return new Intl.NumberFormat(pageLanguage(), { style: "percent" }).format(fraction);
}
