/** The thread that holds the reconstruction in space and registers one frame after the other. */
import { init, describe_spatial_settings, spatial_presets, SpatialReconstruction, version } from './package.js';
import { nothingLoaded, serve, type Served } from './serve.js';
import type {
  RegistrarApi,
  SpatialAnswers,
  SpatialFacts,
  SpatialPreset,
  SpatialSettingDescription,
} from './spatial-protocol.js';

let reconstruction: SpatialReconstruction | null = null;

function engine(): SpatialReconstruction {
  if (!reconstruction) throw nothingLoaded();
  return reconstruction;
}

function forget(): void {
  reconstruction?.free();
  reconstruction = null;
}

const answers: { [K in keyof SpatialAnswers]: (frame: number) => SpatialAnswers[K] } = {
  trajectory_tum: () => engine().trajectory_tum(),
  trajectory_matrices: () => engine().trajectory_matrices(),
  map_ply: () => engine().map_ply(),
  map_pcd: () => engine().map_pcd(),
  map_ply_ascii: () => engine().map_file('ply_ascii'),
  map_pcd_ascii: () => engine().map_file('pcd_ascii'),
  map_pcd_compressed: () => engine().map_file('pcd_binary_compressed'),
  report_json: () => engine().report_json(),
  decode_config: () => engine().decode_config(),
  kept_points: (frame) => engine().kept_points(frame),
  map_before: (frame) => engine().map_before(frame) as Float64Array,
};

const api: Served<RegistrarApi> = {
  async start(module): Promise<SpatialFacts> {
    await init({ module_or_path: module });
    return {
      version: version(),
      descriptions: describe_spatial_settings() as SpatialSettingDescription[],
      presets: spatial_presets() as SpatialPreset[],
    };
  },

  create(given) {
    const next = new SpatialReconstruction(given);
    forget();
    reconstruction = next;
  },

  forget,

  setIntrinsics: (name, bytes) => engine().set_intrinsics(name, bytes),

  begin: (name, first_frame) => engine().begin(name, first_frame),

  place(prepared) {
    const start = performance.now();
    engine().add_prepared(prepared);
    const progress = engine().step();
    const ms = performance.now() - start;
    // The less there is left to stitch after the last frame, when the other threads have nothing to do, the better.
    engine().stitch_ahead();
    return { ...progress, ms, spent: prepared, decodeConfig: engine().decode_config() };
  },

  finish() {
    engine().finish();
    return engine().step();
  },

  setReference: (name, bytes, num_recorded) => engine().set_reference(name, bytes, num_recorded),

  clearReference: () => engine().clear_reference(),

  snapshot() {
    const here = engine();
    const map = here.map_points();
    const { positions, colors, normals, frames } = map;
    map.free();
    return { result: here.result(), points: { positions, colors, normals, frames } };
  },

  mapSize(voxel_size) {
    const start = performance.now();
    const [size] = engine().map_sizes(new Float64Array([voxel_size]));
    return { voxel_size, num_points: 0, num_bytes: 0, ...size, ms: performance.now() - start };
  },

  floorGrid({ up, floor, band }) {
    const grid = engine().flattened_grid(Float64Array.from(up), floor, Float64Array.from(band));
    const { width, height } = grid;
    const files = { pgm: grid.pgm(), yaml: grid.yaml('map.pgm'), width, height, greys: grid.grey_values() };
    grid.free();
    return files;
  },

  ask: <K extends keyof SpatialAnswers>(kind: K, frame: number) => answers[kind](frame) as SpatialAnswers[K],
};

serve<RegistrarApi>(api);
