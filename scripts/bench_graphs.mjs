// @ts-check
/**
 * What optimising pose graphs takes in WebAssembly, one thread: `node scripts/bench_graphs.mjs FILE.g2o...`. Processor time of five
 * searches from the poses of the file, and the chi squared that each ends at. GTSAM's beside it: scripts/bench_gtsam.py.
 */
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import { load, PoseGraph } from '../npm/index.js';

const NUM_RUNS = 5;

await load();
for (const path of process.argv.slice(2)) {
  const bytes = readFileSync(path);
  const runs = Array.from({ length: NUM_RUNS }, () => {
    const graph = PoseGraph.read(bytes, basename(path));
    const start = process.cpuUsage();
    const { from_file } = graph.optimize({ start: 'file' });
    graph.free();
    return { ms: process.cpuUsage(start).user / 1000, ...from_file };
  });
  const times = runs.map(({ ms }) => ms.toFixed(0)).join(' ');
  console.log(`${basename(path)}: ${times} ms, ${runs[0]?.num_iterations} steps, chi squared ${runs[0]?.chi_squared}`);
}
