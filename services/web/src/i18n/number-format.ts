/** Numbers and times in the page's language. Pure. */
import { pageLanguage } from "./translator";

/** Formatters of decimals by language and number of decimal places: creating one takes longer than using it. */
const decimalFormats = new Map<string, Intl.NumberFormat>();

/** Format a number with exactly this many decimal places. */
export function formatDecimal(value: number, digits: number): string {
  const language = pageLanguage();
  const key = `${language} ${digits}`;
  const format =
    decimalFormats.get(key) ??
    new Intl.NumberFormat(language, {
      minimumFractionDigits: digits,
      maximumFractionDigits: digits,
      useGrouping: "min2",
      signDisplay: "negative",
    });
  decimalFormats.set(key, format);
  return format.format(value);
}

/** Format a fraction, 0 to 1, as whole percent. */
export function formatPercent(fraction: number): string {
  return new Intl.NumberFormat(pageLanguage(), { style: "percent" }).format(fraction);
}

/** Format a time (RFC 3339) as day and minute in the user's time zone. */
export function formatTime(time: string): string {
  const options = { month: "long", day: "numeric", hour: "numeric", minute: "2-digit" } as const;
  return new Intl.DateTimeFormat(pageLanguage(), options).format(new Date(time));
}
