// @ts-check
/**
 * Times one benchmark compiled to WebAssembly, as crate/bench/src/main.rs times it natively: the same arguments, the
 * same steps, the same two lines. `node bench_wasm.mjs PKG_DIR NAME WARM_UP_MS SAMPLE_MS SAMPLES [FILE]...`
 */
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const [folder = '', name = '', warmUp, sample, samples, ...files] = process.argv.slice(2);
const glue = await import(pathToFileURL(join(folder, 'scanstitch_bench.js')).href);
glue.initSync({ module: await readFile(join(folder, 'scanstitch_bench_bg.wasm')) });
const benchmark = new glue.PreparedBenchmark(name, files, await Promise.all(files.map((file) => readFile(file))));

// Runs for at least the warm-up and finds how many runs last about as long as a sample.
const start = performance.now();
let warmRuns = 0;
while (warmRuns === 0 || performance.now() - start < Number(warmUp)) {
  benchmark.run(1);
  warmRuns += 1;
}
const oneRun = (performance.now() - start) / warmRuns;
const runs = Math.min(Math.max(Math.ceil(Number(sample) / oneRun), 1), 1e6);

const nanoseconds = Array.from({ length: Number(samples) }, () => {
  const start = performance.now();
  benchmark.run(runs);
  return (((performance.now() - start) * 1e6) / runs).toFixed(1);
});
console.log(benchmark.work());
console.log(nanoseconds.join(' '));
