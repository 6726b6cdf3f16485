declare module "@mediapipe/pose/pose_solution_simd_wasm_bin.js" {
  const createPoseModule: (
    options: import("./pose-solution").PoseModuleOptions,
  ) => Promise<import("./pose-solution").PoseModule>;
  export default createPoseModule;
}
