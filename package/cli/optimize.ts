/** `scanstitch optimize`: the poses of a pose graph's file, moved to where its measured motions fit best. */
import { basename } from 'node:path';
import type { GraphReport, GraphStart, Optimization, PoseGraph } from '../../pkg/scanstitch.js';
import { type Command, CommandError, type Engine, EXIT, oneOf, readArguments, table, wholeNumber } from './command.js';
import { readPiped, writeWhole } from './disk.js';
import { readRequired } from './inputs.js';
import { note, print } from './terminal.js';

const STARTS = ['both', 'file', 'chordal'] as const;

const OPTIONS = {
  out: { type: 'string' },
  start: { type: 'string', default: 'both' },
  iterations: { type: 'string' },
  json: { type: 'boolean', default: false },
} as const;

export const optimize: Command = {
  name: 'optimize',
  about: 'poses of a pose graph (g2o, TORO) where its measured motions fit best',
  help: () => `scanstitch optimize GRAPH [OPTION]...

Reads a pose graph (g2o: VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX; TORO: VERTEX2, EDGE2, VERTEX3,
EDGE3; - reads it from stdin) and moves its poses to the least sum of squared Mahalanobis distances (chi squared), by
Levenberg-Marquardt. Fixed nodes stay where they are; in a part of the graph without one, its first node does. Poses
that the file does not give are composed along the edges.

From poses with much drift the search may end in another minimum than the lowest. A second one begins at poses that
follow from the edges alone (chordal relaxation); the better of both results is kept.

Printed: chi squared before and after, and the edges that the others contradict most.

Options:
  --out FILE        the optimised graph: g2o; where the name ends in .graph, TORO's lines, of a graph in the plane and
                    without what is fixed; where it ends in .tum, the poses, numbered, as a trajectory
  --start START     ${STARTS.join(' | ')} (default: both)
  --iterations N    steps of each search at most (default: 200)
  --json            the report as JSON

Examples:
  scanstitch optimize intel.g2o --out optimized.g2o
  scanstitch optimize manhattan.g2o --start file --json
`,
  run,
};

async function run(engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('optimize', { args, options: OPTIONS, allowPositionals: true });
  const [path, ...others] = positionals;
  if (path === undefined || others.length > 0) {
    throw new CommandError('Name one pose graph. See: scanstitch optimize --help');
  }
  const start = oneOf('start', values.start, STARTS);
  const iterations = wholeNumber('iterations', values.iterations);
  const graph = engine.PoseGraph.read(path === '-' ? readPiped() : readRequired({ name: path, path }), basename(path));
  try {
    const report = graph.optimize({ start, ...(iterations !== undefined && { max_iterations: iterations }) });
    print(values.json ? `${JSON.stringify({ graph: path, ...report }, null, 2)}\n` : printed(report));
    tellDoubts(report);
    if (values.out !== undefined) await writeWhole(values.out, written(graph, values.out));
    return EXIT.done;
  } finally {
    graph.free();
  }
}

function written(graph: PoseGraph, name: string) {
  if (name.endsWith('.tum')) return trajectoryOf(graph.poses());
  return name.endsWith('.graph') ? toro(graph.to_g2o()) : graph.to_g2o();
}

/** A graph in the plane as TORO has it, which GTSAM's load2D reads: another order of the numbers of an information matrix. */
function toro(g2o: string) {
  const rows = g2o.split('\n').map((line) => line.split(' '));
  if (rows.some(([kind]) => kind?.startsWith('VERTEX_SE3'))) {
    throw new CommandError('A graph in space is written as g2o: end the name of --out in .g2o');
  }
  const lines = rows.flatMap(([kind, ...numbers]) => {
    if (kind === 'VERTEX_SE2') return [['VERTEX2', ...numbers]];
    if (kind !== 'EDGE_SE2') return [];
    const [xx, xy, xt, yy, yt, tt] = numbers.slice(5);
    return [['EDGE2', ...numbers.slice(0, 5), xx, xy, yy, tt, xt, yt]];
  });
  return lines.map((line) => `${line.join(' ')}\n`).join('');
}

function printed({
  num_nodes,
  num_edges,
  dimension,
  degrees_of_freedom,
  from_file,
  from_chordal,
  used,
  worst_edges,
}: GraphReport) {
  const space = dimension === 2 ? 'in the plane' : 'in space';
  const searches = [row('file', 'from the poses', from_file), row('chordal', 'from the edges alone', from_chordal)];
  function row(start: GraphStart, name: string, search: Optimization | null) {
    if (!search) return [];
    const { initial_chi_squared, chi_squared, num_iterations, converged } = search;
    const end = `${converged ? '' : 'stopped, not converged; '}${start === used ? 'kept' : 'not kept'}`;
    return [[name, figure(initial_chi_squared), figure(chi_squared), String(num_iterations), end]];
  }
  const worst = worst_edges.map(({ from, to, squared_distance }) => [
    String(from),
    String(to),
    figure(squared_distance),
  ]);
  return `${num_nodes} poses and ${num_edges} measured motions ${space}; with right information matrices chi squared is about ${degrees_of_freedom}

${table(['search', 'chi squared before', 'after', 'steps', ''], searches.flat(), new Set([0, 4]))}
Least fitting:
${table(['from', 'to', 'squared distance'], worst, new Set())}`;
}

/** Six digits. */
function figure(value: number) {
  return value === 0 || (value >= 1e-3 && value < 1e9) ? String(Number(value.toPrecision(9))) : value.toExponential(5);
}

function tellDoubts({ num_parts, num_composed, from_file, from_chordal, used }: GraphReport) {
  if (num_composed > 0) {
    note(`${num_composed} nodes have no pose in the file: theirs begins where the edges, composed, lead to`);
  }
  if (num_parts > 1) {
    note(`The graph is in ${num_parts} parts that no edge joins: how they lie to each other means nothing`);
  }
  const search = used === 'chordal' ? from_chordal : from_file;
  if (search && !search.converged) note('The search was stopped before it converged: raise --iterations');
}

/** A number before each pose, as the time of a trajectory. */
function trajectoryOf(poses: Float64Array) {
  const lines = [];
  for (let node = 0; 7 * node < poses.length; node += 1) {
    lines.push(`${node} ${poses.subarray(7 * node, 7 * node + 7).join(' ')}\n`);
  }
  return lines.join('');
}
