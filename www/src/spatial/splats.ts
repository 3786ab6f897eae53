/** The files that trainers of splats open, of the run that is shown. Loaded on demand. */
import { placedFrames } from '../../../package/mesh/frames.js';
import { splatFiles } from '../../../package/mesh/splats.js';
import type { SpatialResult } from '../engine/spatial-protocol.js';
import type { SpatialSession } from './session.js';

export async function splatsOf(session: SpatialSession, result: SpatialResult): Promise<Record<string, Uint8Array>> {
  const files: Record<string, Uint8Array> = {};
  const places = new Map(result.frames.map(({ index }, at) => [index, at]));
  if (!result.camera) throw new Error('Clouds have no pictures');
  const count = await splatFiles(
    result.camera,
    placedFrames(result),
    session.points,
    async ({ index }) => {
      const { color } = session.filesOf(places.get(index) ?? -1);
      return color && color.read();
    },
    (path, bytes) => {
      files[path] = bytes;
    },
  );
  if (count === 0) throw new Error('No frame with a good pose has a picture as PNG or JPEG');
  return files;
}
