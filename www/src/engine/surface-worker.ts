/** The thread that makes and holds the surface of a run. */
import { decimate } from '../../../package/mesh/decimate.js';
import { meshFile } from '../../../package/mesh/files.js';
import { init, Surface } from './package.js';
import { nothingLoaded, serve, type Served } from './serve.js';
import type { SurfaceApi } from './surface-protocol.js';

let surface: Surface | null = null;

function present(): Surface {
  if (!surface) throw nothingLoaded();
  return surface;
}

const api: Served<SurfaceApi> = {
  async start(module) {
    await init({ module_or_path: module });
  },

  begin(decode_config, voxel_size, max_megabytes) {
    surface = new Surface(decode_config, { voxel_size, max_megabytes });
  },

  follow: (frames, poses, isFinal) => present().follow(frames, poses, isFinal) as Uint32Array,

  put: (frame, kept) => present().put(frame, kept),

  async mesh(maxTriangles, maxHoleSize) {
    const here = present();
    here.set_max_hole_size(maxHoleSize);
    const moved = maxTriangles === null ? 0 : await decimate(here, maxTriangles);
    return {
      moved,
      positions: here.positions(),
      normals: here.normals(),
      colors: here.colors(),
      deviations: here.deviations(),
      filled: here.filled(),
      num_filled: here.num_filled,
      triangles: here.triangles(),
      num_frames: here.num_frames,
      voxel_size: here.voxel_size,
      is_of_clouds: here.is_of_clouds,
    };
  },

  file: (format) => meshFile(present(), format),
};

serve<SurfaceApi>(api);
