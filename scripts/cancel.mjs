// @ts-check
/**
 * `node scripts/cancel.mjs [--gigabytes 2] [--megabytes 8] [--times 10] [--seconds 60]`: a large bag and a large laser log are
 * generated (0: skipped) and reconstructed on the command line, and each run is stopped at a random moment. The results computed by
 * then must be written completely, and a following run must succeed. Prints one line per run.
 */
import { closeSync, existsSync, mkdtempSync, openSync, readFileSync, rmSync, writeSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { roomScan } from '../tests/cli/support.mjs';
import { runWith, wholeFiles } from './fuzz/signals.mjs';
import { writeLargeBag } from './large_bag.mjs';
import { readArguments, runMain, StepError } from './steps.mjs';

/** Images of the bag and scans of the log that are rendered; the walks repeat them to and fro. */
const BAG_VIEWS = 8;
const NUM_VIEWS = 60;

/** A log as CARMEN writes it. @param {string} path @param {number} megabytes */
function writeLargeLog(path, megabytes) {
  const views = Array.from({ length: NUM_VIEWS }, (_, i) => {
    const rows = roomScan([0.02 * i, 0.03 * i, 0.004 * i]).split('end_header\n')[1] ?? '';
    const points = rows.trimEnd().split('\n');
    return points.map((point) => Math.hypot(...point.split(' ').map(Number)).toFixed(3)).join(' ');
  });
  const file = openSync(path, 'w');
  let written = 0;
  for (let i = 0; written < megabytes * 2 ** 20; i += 1) {
    const turn = i % (2 * NUM_VIEWS);
    const ranges = views[turn < NUM_VIEWS ? turn : 2 * NUM_VIEWS - 1 - turn] ?? '';
    written += writeSync(file, `FLASER 180 ${ranges} 0 0 0 0 0 0 ${i / 10} robot ${i / 10}\n`);
  }
  closeSync(file);
}

/** @param {string} folder */
function numPoses(folder) {
  const path = join(folder, 'trajectory.tum');
  if (!existsSync(path)) return 0;
  return readFileSync(path, 'utf8')
    .split('\n')
    .filter((line) => line !== '' && !line.startsWith('#')).length;
}

/** Stops a run somewhere in its first seconds; says what it left. @param {string} name @param {string} input @param {string} out @param {number} seconds */
async function stopped(name, input, out, seconds) {
  const ms = 1000 * seconds * Math.random();
  const { code, stderr, milliseconds } = await runWith(['reconstruct', input, '--out', out], tmpdir(), [
    [ms, 'SIGINT'],
  ]);
  const [files, poses] = [wholeFiles(out), numPoses(out)];
  const told = Number(stderr.match(/^Stopped after (\d+)/m)?.[1] ?? 0);
  const took = `${((milliseconds - ms) / 1000).toFixed(1)} s later`;
  console.log(
    `${name}, at ${(ms / 1000).toFixed(1)} s: exit code ${code} ${took}, ${files.length} files, ${poses} poses, told ${told}`,
  );
  if (poses < told || (told > 0 && files.length === 0))
    throw new StepError(`${told} frames were reported, ${poses} were written: ${stderr}`);
  if (/defect/.test(stderr)) throw new StepError(stderr);
}

await runMain(async () => {
  const options = /** @type {const} */ ({
    gigabytes: { type: 'string', default: '2' },
    megabytes: { type: 'string', default: '8' },
    times: { type: 'string', default: '10' },
    seconds: { type: 'string', default: '60' },
  });
  const { values } = readArguments(
    { options },
    'Usage: node scripts/cancel.mjs [--gigabytes 2] [--megabytes 8] [--times 10] [--seconds 60]',
  );
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-cancel-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  for (const signal of ['SIGINT', 'SIGTERM']) process.once(signal, () => process.exit(1));
  const [bag, log] = [join(folder, 'walk.mcap'), join(folder, 'drive.log')];
  const [gigabytes, megabytes] = [Number(values.gigabytes), Number(values.megabytes)];
  if (gigabytes > 0) writeLargeBag(bag, gigabytes, 'mcap', BAG_VIEWS);
  if (megabytes > 0) writeLargeLog(log, megabytes);
  for (const [name, input] of Object.entries({ bag, log })) {
    if (!existsSync(input)) continue;
    const out = join(folder, name);
    for (let i = 0; i < Number(values.times); i += 1) {
      if (i % 2 === 0) rmSync(out, { recursive: true, force: true });
      await stopped(name, input, out, Number(values.seconds));
    }
    const { code, stderr, milliseconds } = await runWith(['reconstruct', input, '--out', out], folder, []);
    if (code !== 0) throw new StepError(`${name}: the run afterwards exited with ${code}: ${stderr}`);
    const whole = `${wholeFiles(out).length} files, ${numPoses(out)} poses`;
    console.log(`${name}, whole: exit code 0 after ${(milliseconds / 1000).toFixed(0)} s, ${whole}`);
  }
});
