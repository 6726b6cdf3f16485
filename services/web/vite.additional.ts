/** Builds that add files to the folder of the page, after the page itself has been built. */
import type { BuildOptions, UserConfig } from "vite";

/** Return the configuration of an additional build with these entry points and chunks. */
export function additionalBuild(rolldownOptions: NonNullable<BuildOptions["rolldownOptions"]>): UserConfig {
  return {
    // Relative URLs: the files find each other whichever site or path loads them.
    base: "./",
    build: {
      outDir: "../bunraku/page",
      emptyOutDir: false,
      copyPublicDir: false,
      target: "es2023",
      assetsInlineLimit: 0,
      modulePreload: false,
      chunkSizeWarningLimit: 700,
      rolldownOptions,
    },
  };
}
