// @ts-check
/** Other tools on the same input in the same run, where they can be had: small_gicp for Python, in an environment of its own. */
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { capture, findProgram, ROOT, StepError, TARGET_DIR } from './steps.mjs';

const PAIR = join(ROOT, '../shared/data/lidar/kitti_pair');
const ENVIRONMENT = join(TARGET_DIR, 'small_gicp');
const PYTHON = join(ENVIRONMENT, 'bin', 'python');

/** Whether small_gicp can be timed; it is installed into the target folder when it is asked for first, with NumPy, which it needs. */
export async function hasSmallGicp() {
  if (!existsSync(PAIR)) return false;
  const python = findProgram(['python3']);
  const imports = async () => (await capture(PYTHON, ['-c', 'import small_gicp'])).code === 0;
  if (existsSync(PYTHON) && (await imports())) return true;
  if (python && (await capture(python, ['-m', 'venv', ENVIRONMENT])).code === 0) {
    await capture(PYTHON, ['-m', 'pip', 'install', '--quiet', 'small_gicp', 'numpy']);
    if (await imports()) return true;
  }
  console.error('skipped small_gicp: it could not be installed');
  return false;
}

/**
 * Nanoseconds of each sample, by method.
 * @param {{ warm_up_ms: number, samples: number }} policy
 * @returns {Promise<{ name: string, nanoseconds: number[] }[]>}
 */
export async function timeSmallGicp({ warm_up_ms, samples }) {
  const clouds = ['target.ply', 'source.ply'].map((name) => join(PAIR, name));
  const script = join(ROOT, 'scripts', 'bench_small_gicp.py');
  const { code, output } = await capture(PYTHON, [script, ...clouds, String(warm_up_ms), String(samples)]);
  if (code !== 0) throw new StepError(`small_gicp could not be timed:\n${output}`);
  return output
    .trim()
    .split('\n')
    .map((line) => {
      const [name = '', ...nanoseconds] = line.split(' ');
      return { name, nanoseconds: nanoseconds.map(Number) };
    });
}
