// @ts-check
/**
 * Times one benchmark compiled to WebAssembly under Node, as crate/bench/src/main.rs times it natively: the same
 * arguments, the same two lines. `node bench_wasm.mjs PKG_DIR NAME WARM_UP_MS SAMPLE_MS SAMPLES [FILE]...`
 */
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { takeSamples } from './bench_samples.mjs';

const [folder = '', name = '', warm_up, sample, samples, ...files] = process.argv.slice(2);
const glue = await import(pathToFileURL(join(folder, 'scanstitch_bench.js')).href);
glue.initSync({ module: await readFile(join(folder, 'scanstitch_bench_bg.wasm')) });
const benchmark = new glue.PreparedBenchmark(name, files, await Promise.all(files.map((file) => readFile(file))));
const policy = { warm_up_ms: Number(warm_up), sample_ms: Number(sample), samples: Number(samples) };
const nanoseconds = takeSamples(benchmark, policy);
console.log(benchmark.work());
console.log(nanoseconds.map((sample) => sample.toFixed(1)).join(' '));
