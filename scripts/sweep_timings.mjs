// @ts-check
/** What bench_sweeps.mjs times, in Node and in a page alike. */

/**
 * Registers the sweeps of PCD files one after the other, and tells of the first ones, during which the engine is compiled in other
 * threads, and of all others, what one takes: to read (ms), to prepare less that, to register.
 * @param {any} engine the module `scanstitch.js`, initialized
 * @param {(number: number) => Promise<Uint8Array>} fileOf
 * @param {[number, number]} counts of the first sweeps, of all
 * @param {() => Promise<number>} processorTime of this process (ms)
 */
export async function timeSweeps(engine, fileOf, [numFirst, count], processorTime) {
  const { PointCloud, prepare_cloud, SpatialReconstruction } = engine;
  const spent = [0, 0, 0];
  /** @template T @param {number} stage @param {() => T} work */
  const timed = async (stage, work) => {
    const before = await processorTime();
    const result = work();
    spent[stage] = (spent[stage] ?? 0) + (await processorTime()) - before;
    return result;
  };

  const files = await Promise.all(Array.from({ length: count }, (_, number) => fileOf(number)));
  const reconstruction = new SpatialReconstruction({});
  const config = reconstruction.begin('0.pcd', files[0]);
  const lines = [];
  for (const [number, file] of files.entries()) {
    const name = `${number}.pcd`;
    await timed(0, () => PointCloud.read(file, name).free());
    const prepared = await timed(1, () => prepare_cloud(config, name, number, number / 10, file));
    await timed(2, () => {
      reconstruction.add_prepared(prepared);
      while (reconstruction.step().stage !== 'done');
    });
    if (number + 1 !== numFirst && number + 1 !== count) continue;
    const timedNow = number + 1 === numFirst ? numFirst : count - numFirst;
    const [reading = 0, preparing = 0, registering = 0] = spent.map((milliseconds) => milliseconds / timedNow);
    lines.push(
      `${timedNow} sweeps: ${(preparing - reading + registering).toFixed(1)} ms a sweep and ${reading.toFixed(1)} for reading (preparing ${(preparing - reading).toFixed(1)}, registering ${registering.toFixed(1)})`,
    );
    spent.fill(0);
  }
  const { frames } = reconstruction.result();
  return [...lines, `${frames.filter((/** @type {any} */ { status }) => status === 'good').length} good`];
}
