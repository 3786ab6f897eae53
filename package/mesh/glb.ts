/** A surface as a binary glTF file (GLB), which browsers, phones and most programs for models show. */
import type { Surface } from '../../pkg/scanstitch.js';

/** glTF has y up and looks along -z. The world of a camera has y down and z ahead: a half turn about x; that of a lidar has z up. */
const HALF_TURN_ABOUT_X = [1, 0, 0, 0] as const;
const QUARTER_TURN_ABOUT_X = [-Math.SQRT1_2, 0, 0, Math.SQRT1_2] as const;

export async function toGlb(
  surface: Pick<Surface, 'positions' | 'normals' | 'colors' | 'triangles' | 'is_of_clouds'>,
): Promise<Uint8Array> {
  const { Document, WebIO } = await import('@gltf-transform/core');
  const document = new Document();
  const buffer = document.createBuffer();
  const accessor = (type: 'SCALAR' | 'VEC3', array: Float32Array | Uint8Array | Uint32Array) =>
    document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const colors = surface.colors();
  const material = document.createMaterial('surface').setDoubleSided(true).setRoughnessFactor(1).setMetallicFactor(0);
  const primitive = document
    .createPrimitive()
    .setMaterial(material)
    .setIndices(accessor('SCALAR', surface.triangles()))
    .setAttribute('POSITION', accessor('VEC3', surface.positions()))
    .setAttribute('NORMAL', accessor('VEC3', surface.normals()));
  if (colors.length > 0) primitive.setAttribute('COLOR_0', accessor('VEC3', linear(colors)));
  const mesh = document.createMesh('surface').addPrimitive(primitive);
  const node = document
    .createNode('surface')
    .setMesh(mesh)
    .setRotation([...(surface.is_of_clouds ? QUARTER_TURN_ABOUT_X : HALF_TURN_ABOUT_X)]);
  document.createScene('scene').addChild(node);
  return new WebIO().writeBinary(document);
}

/** glTF's colours of vertices are linear; pictures are sRGB (IEC 61966-2-1). */
function linear(colors: Uint8Array) {
  const table = Float32Array.from({ length: 256 }, (_, value) => {
    const x = value / 255;
    return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
  });
  return Float32Array.from(colors, (value) => table[value] ?? 0);
}
