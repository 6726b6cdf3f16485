/** Interface of the encoder in `draco3d`, as far as the tests use it; the package declares none. */
declare module "draco3d" {
  interface Encoder {
    SetTrackEncodedProperties(on: boolean): void;
    EncodeMeshToDracoBuffer(mesh: unknown, output: { GetValue(at: number): number }): number;
    GetNumberOfEncodedPoints(): number;
    GetNumberOfEncodedFaces(): number;
  }
  interface MeshBuilder {
    AddFacesToMesh(mesh: unknown, count: number, indices: Uint32Array): boolean;
    AddFloatAttributeToMesh(mesh: unknown, type: number, count: number, width: number, values: Float32Array): number;
    AddUInt8Attribute(mesh: unknown, type: number, count: number, width: number, values: Uint8Array): number;
  }
  interface EncoderModule {
    readonly Encoder: new () => Encoder;
    readonly MeshBuilder: new () => MeshBuilder;
    readonly Mesh: new () => object;
    readonly DracoInt8Array: new () => { GetValue(at: number): number };
    readonly POSITION: number;
    readonly NORMAL: number;
    readonly TEX_COORD: number;
    readonly GENERIC: number;
  }
  const draco3d: { createEncoderModule(options: object): Promise<EncoderModule> };
  export default draco3d;
}
