/** Numbers in the page's language. Pure. */
import { pageLanguage } from "./translator";

/** Format a number with exactly this many decimal places. */
export function formatDecimal(value: number, digits: number): string {
  return new Intl.NumberFormat(pageLanguage(), {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: "min2",
    signDisplay: "negative",
  }).format(value);
}

/** Format a fraction, 0 to 1, as whole percent. */
export function formatPercent(fraction: number): string {
  return new Intl.NumberFormat(pageLanguage(), { style: "percent" }).format(fraction);
}
