// @ts-check
/**
 * What both JavaScript harnesses do with a prepared benchmark, as crate/bench/src/main.rs does natively: warm up, find
 * how many runs last about as long as a sample, take the samples. It must stand alone: a browser is handed its source.
 */

/**
 * @param {{ run(runs: number): void }} benchmark
 * @param {{ warm_up_ms: number, sample_ms: number, samples: number }} policy
 * @returns {number[]} nanoseconds of one run in each sample
 */
export function takeSamples(benchmark, { warm_up_ms, sample_ms, samples }) {
  const start = performance.now();
  let warm_runs = 0;
  while (warm_runs === 0 || performance.now() - start < warm_up_ms) {
    benchmark.run(1);
    warm_runs += 1;
  }
  const one_run = (performance.now() - start) / warm_runs;
  const runs = Math.min(Math.max(Math.ceil(sample_ms / one_run), 1), 1e6);
  return Array.from({ length: samples }, () => {
    const start = performance.now();
    benchmark.run(runs);
    return ((performance.now() - start) * 1e6) / runs;
  });
}
