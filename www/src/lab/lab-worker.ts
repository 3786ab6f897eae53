/** A thread of the lab: it holds two clouds, and answers what is asked of the methods that register them. */
import { decode_depth, IcpLab, init, local_minima, PointCloud, version } from '../engine/package.js';
import { compareOwnIcp, type OwnIcpComparison } from '../../../package/lab/own_icp.js';
import { nothingLoaded, serve } from '../engine/serve.js';
import type { CloudData } from '../run/given-clouds.js';
import type { EngineGrid, GridPart, LabApi, LabFacts, LabTrace, Options, Pose } from './protocol.js';

let clouds: { source: PointCloud; target: PointCloud } | null = null;
const labs = new Map<number, IcpLab>();
const optionsOf = new Map<number, Options>();

serve<LabApi>({
  async start(module) {
    await init({ module_or_path: module });
    return version();
  },
  open(source, target) {
    for (const lab of labs.values()) lab.free();
    labs.clear();
    clouds?.source.free();
    clouds?.target.free();
    clouds = null;
    clouds = { source: cloudOf(source), target: cloudOf(target) };
  },
  prepare,
  forget(method) {
    labs.get(method)?.free();
    labs.delete(method);
    optionsOf.delete(method);
  },
  trace,
  traced_iteration: (method, index) => labOf(method).traced_iteration(index),
  iteration: (method, T, stride) => labOf(method).iteration(numbers(T), stride),
  landscape: (method, part) => labOf(method).cost_landscape(gridOf(part)),
  search_path: (method, T, translation, rotation) => labOf(method).search_path(numbers(T), translation, rotation),
  minima: (costs, width) => local_minima(costs, width),
  basin: (method, part) => labOf(method).basin_of_attraction(gridOf(part)),
  own,
  label: (method, ends, reference) => labOf(method).label_ends(ends, numbers(reference)),
});

function prepare(method: number, options: Options): LabFacts {
  if (!clouds) throw nothingLoaded();
  const lab = new IcpLab(clouds.source, clouds.target, options);
  labs.get(method)?.free();
  labs.set(method, lab);
  optionsOf.set(method, options);
  const normals = lab.target_normals();
  // What is drawn needs no more than single precision.
  const single = (values: Float64Array): Float32Array<ArrayBuffer> => Float32Array.from(values);
  return {
    is_planar: lab.is_planar,
    source_points: single(lab.source_points()),
    target_points: single(lab.target_points()),
    target_normals: normals.some((value) => !Number.isNaN(value)) ? single(normals) : new Float32Array(0),
  };
}

function trace(method: number, start: Pose | null): LabTrace {
  const lab = labOf(method);
  const begin = performance.now();
  const { converged, end_reason, initial, poses, records, costs } = lab.trace(start && numbers(start));
  const milliseconds = performance.now() - begin;
  return { converged, end_reason, poses: Float64Array.from([initial, ...poses].flat()), records, costs, milliseconds };
}

function own(method: number, poses: readonly (readonly number[])[]): OwnIcpComparison {
  if (!clouds) throw nothingLoaded();
  const init_T_target_source = [...(poses[0] ?? [])] as EngineGrid['T_center'];
  const options = { ...optionsOf.get(method), init_T_target_source };
  return compareOwnIcp({ IcpLab }, clouds.source, clouds.target, options, [...poses]);
}

function labOf(method: number): IcpLab {
  const lab = labs.get(method);
  if (!lab) throw nothingLoaded();
  return lab;
}

function cloudOf(cloud: CloudData): PointCloud {
  if (cloud.kind === 'file') return PointCloud.read(cloud.bytes, cloud.name);
  if (cloud.kind === 'positions') return PointCloud.from_positions(cloud.xyz, cloud.normals);
  return PointCloud.from_positions(pointsOf(cloud));
}

/** Every pixel with a depth as a point (x right, y down, z forward). */
function pointsOf({ name, bytes, camera, depth_scale }: Extract<CloudData, { kind: 'depth' }>): Float32Array {
  const picture = decode_depth(name, bytes);
  try {
    const { width } = picture;
    const { fx, fy, cx, cy } = camera;
    return Float32Array.from(
      Array.from(picture.values()).flatMap((raw, i) => {
        const z = raw / depth_scale;
        return raw > 0 ? [((i % width) - cx) * (z / fx), (Math.floor(i / width) - cy) * (z / fy), z] : [];
      }),
    );
  } finally {
    picture.free();
  }
}

const numbers = (T: Pose): Float64Array => Float64Array.from(T);

function gridOf({ T_center, axes, half_widths, size, stride, rows }: GridPart): EngineGrid {
  return {
    T_center: Array.from(T_center) as EngineGrid['T_center'],
    axes: [...axes],
    half_widths: [...half_widths],
    size: [...size],
    rows: [...rows],
    stride,
  };
}
