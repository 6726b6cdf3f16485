/** Numbers in the page's language. Pure. */
import { language } from "./say";

/** With so many digits after the point, neither more nor fewer. */
export function decimal(value: number, digits: number): string {
  return new Intl.NumberFormat(language(), { minimumFractionDigits: digits, maximumFractionDigits: digits, useGrouping: "min2", signDisplay: "negative" }).format(value);
}

/** A share, 0 to 1, in whole hundredths. */
export function percent(share: number): string {
  return new Intl.NumberFormat(language(), { style: "percent" }).format(share);
}
