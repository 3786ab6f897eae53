// @ts-check
/**
 * `npm test`: everything that can be checked, each stage with its counts and duration, and as the last line the sum,
 * `N passed, N failed`. A stage that fails does not stop the later ones; the exit code tells.
 * `npm test -- --only NAME` runs one stage (more with more `--only`), `--only lint` all checks that run no test,
 * `--list` names them.
 */
import { existsSync, mkdirSync, readFileSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import {
  answers,
  buildTestTools,
  buildWasm,
  capture,
  duration,
  ensureNodeModules,
  ensureRustLinters,
  ensureWasmTarget,
  findChromium,
  prependPath,
  readArguments,
  requireToolchain,
  run,
  runMain,
  StepError,
  step,
  TARGET_DIR,
} from './steps.mjs';

const WASM = ['--target', 'wasm32-unknown-unknown'];
/** The packages that compile to WebAssembly: all but the tools that make it. */
const ENGINE = ['--package', 'scanstitch', '--package', 'scanstitch-bench'];
const CLIPPY = ['cargo', 'clippy', '--all-targets', '--all-features'];
const STRICTLY = ['--', '-D', 'warnings'];
const WASM_PACK_VERSION = '0.15.1';

/** @typedef {{ passed: number, failed: number }} Counts */
/** @typedef {{ name: string, about: string, lint?: boolean, needs?: (() => Promise<void>)[], run: () => Promise<Counts> }} Stage */

/** @type {Stage[]} */
const STAGES = [
  lint('format', 'Rust is formatted', ['cargo', 'fmt', '--all', '--check'], [ensureRustLinters]),
  lint('clippy', 'clippy finds nothing', [...CLIPPY, '--workspace', ...STRICTLY], [ensureRustLinters]),
  lint(
    'clippy-wasm',
    'clippy finds nothing in the WebAssembly build',
    [...CLIPPY, ...WASM, ...ENGINE, ...STRICTLY],
    [ensureRustLinters, ensureWasmTarget],
  ),
  lint('docs', 'the Rust documentation builds, and its links lead somewhere', [
    ...['cargo', 'doc', '--no-deps', '--lib', ...ENGINE],
  ]),
  lint(
    'prettier',
    'JavaScript, TypeScript, HTML and CSS are formatted',
    ['npx', 'prettier', '--check', '--log-level', 'warn', '.'],
    [ensureNodeModules],
  ),
  lint(
    'promises',
    'no promise is left without anybody waiting for it',
    ['npx', 'oxlint', '--type-aware', 'www/src', 'npm', 'scripts', 'tests/cli', 'tests/e2e'],
    [ensureNodeModules, engine],
  ),
  lint(
    'types',
    'types of the package, scripts and tests',
    ['npx', 'tsc', '--project', '.'],
    [ensureNodeModules, engine],
  ),
  lint('types-page', 'types of the page', ['npx', 'tsc', '--project', 'www'], [ensureNodeModules, engine]),
  {
    name: 'rust',
    about: 'native tests',
    run: () => cargoTests('cargo', ['test', '--no-fail-fast', ...ENGINE]),
  },
  {
    name: 'wasm',
    about: 'tests of the WebAssembly build in headless Chromium',
    needs: [ensureWasmTarget, browser],
    run: () => cargoTests('cargo', ['test', '--no-fail-fast', ...WASM, '--test', 'browser']),
  },
  {
    name: 'wasm-pack',
    about: 'wasm-pack test --headless --chrome',
    needs: [ensureWasmTarget, browser, wasmPack],
    run: () => cargoTests('wasm-pack', ['test', '--headless', '--chrome']),
  },
  {
    name: 'cli',
    about: 'the command line and the npm package',
    needs: [ensureNodeModules, engine],
    run: nodeTests,
  },
  {
    name: 'build',
    about: 'npm run build',
    run: () => succeeds(['npm', 'run', '--silent', 'build']),
  },
  {
    name: 'e2e',
    about: 'the built page in Chromium',
    needs: [ensureNodeModules, browser, page],
    run: playwrightTests,
  },
];

/**
 * A stage that runs no test: one command, one check.
 * @param {string} name
 * @param {string} about
 * @param {string[]} command
 * @param {Stage['needs']} [needs]
 * @returns {Stage}
 */
function lint(name, about, command, needs = []) {
  return { name, about, lint: true, needs, run: () => succeeds(command) };
}

/** @param {string[]} command */
async function succeeds([program = '', ...args]) {
  // What -D warnings is to clippy, on its command line, this is to rustdoc.
  const { code } = await capture(program, args, { env: { RUSTDOCFLAGS: '-D warnings' }, echo: true });
  return code === 0 ? { passed: 1, failed: 0 } : { passed: 0, failed: 1 };
}

// What stages need. Each is done once, by the first stage that needs it.

/** The engine in pkg/. */
async function engine() {
  await ensureWasmTarget();
  await buildWasm();
}

/** The page in www/dist: as the build stage left it, or built here where that stage was not asked for. */
async function page() {
  const built = outcomes.get('build');
  if (!built) await run('npm', ['run', '--silent', 'build']);
  else if (built.failed > 0) throw new StepError('There is no page to test: the build stage failed.');
}

/** Chromium and its driver. */
async function browser() {
  if (answers('chromedriver') && findChromium()) return;
  const packages = ['chromium', 'chromium-driver'];
  const install = `apt-get install --no-install-recommends ${packages.join(' ')}`;
  if (process.getuid?.() !== 0 || !answers('apt-get')) {
    throw new StepError(
      `Chromium and its driver are missing, and only root can install them. On Debian: sudo ${install}\n` +
        'Elsewhere, put `chromium` or `google-chrome` and `chromedriver` of the same version on the PATH.',
    );
  }
  await step('Installing Chromium and its driver (apt)', async () => {
    const env = { DEBIAN_FRONTEND: 'noninteractive' };
    await run('apt-get', ['update', '--quiet=2'], { env });
    await run('apt-get', ['install', '--yes', '--quiet=2', '--no-install-recommends', ...packages], { env });
  });
}

/** wasm-pack, and the locked wasm-bindgen on the PATH, which it would build for minutes otherwise. */
async function wasmPack() {
  await buildTestTools();
  prependPath(join(TARGET_DIR, 'tools'));
  const root = join(TARGET_DIR, 'wasm-pack');
  prependPath(join(root, 'bin'));
  if (answers('wasm-pack')) return;
  await step(`Installing wasm-pack ${WASM_PACK_VERSION} into target/wasm-pack`, () =>
    // Unoptimised: it only starts other programs, and is built in half the time.
    run('cargo', ['install', 'wasm-pack', '--version', WASM_PACK_VERSION, '--locked', '--debug', '--root', root], {
      env: { CARGO_PROFILE_DEV_DEBUG: '0' },
    }),
  );
}

// What the runners count.

/**
 * @param {string} command
 * @param {string[]} args
 */
async function cargoTests(command, args) {
  const { code, output } = await capture(command, args, { echo: true });
  const counts = { passed: 0, failed: 0 };
  for (const [, passed, failed] of output.matchAll(/^test result: .*?(\d+) passed; (\d+) failed;/gm)) {
    counts.passed += Number(passed);
    counts.failed += Number(failed);
  }
  return believe(counts, code);
}

async function nodeTests() {
  const args = ['--test', '--test-reporter=spec', 'tests/cli/'];
  const { code, output } = await capture(process.execPath, args, { echo: true });
  const count = (/** @type {string} */ word) => Number(output.match(new RegExp(`^ℹ ${word} (\\d+)$`, 'm'))?.[1] ?? 0);
  return believe({ passed: count('pass'), failed: count('fail') + count('cancelled') }, code);
}

async function playwrightTests() {
  mkdirSync(TARGET_DIR, { recursive: true });
  const report = join(TARGET_DIR, 'e2e.json');
  rmSync(report, { force: true });
  const { code } = await capture('npx', ['playwright', 'test'], { env: { E2E_REPORT: report }, echo: true });
  if (!existsSync(report)) return believe({ passed: 0, failed: 0 }, code);
  const { stats } = JSON.parse(readFileSync(report, 'utf8'));
  return believe({ passed: stats.expected, failed: stats.unexpected + stats.flaky }, code);
}

/**
 * A runner that failed without naming a test, or ran none, has failed once.
 * @param {Counts} counts
 * @param {number} code
 * @returns {Counts}
 */
function believe({ passed, failed }, code) {
  if (failed > 0) return { passed, failed };
  if (code !== 0) return { passed, failed: 1 };
  if (passed > 0) return { passed, failed };
  console.error('No test was run.');
  return { passed, failed: 1 };
}

/** @type {Map<() => Promise<void>, Promise<void>>} */
const met = new Map();

/**
 * @param {Stage} stage
 * @returns {Promise<Counts>}
 */
async function runStage(stage) {
  try {
    for (const need of stage.needs ?? []) {
      const done = met.get(need) ?? need();
      met.set(need, done);
      await done;
    }
    return await stage.run();
  } catch (error) {
    console.error(error instanceof StepError ? error.message : error);
    return { passed: 0, failed: 1 };
  }
}

/** @param {string[]} names */
function select(names) {
  const unknown = names.find((name) => name !== 'lint' && !STAGES.some((stage) => stage.name === name));
  if (unknown !== undefined) {
    const known = STAGES.map(({ name }) => name).join(', ');
    throw new StepError(`No stage is called ${unknown}. There are: ${known}; and lint for the first of them.`);
  }
  return STAGES.filter(
    ({ name, lint }) => names.length === 0 || names.includes(name) || (lint && names.includes('lint')),
  );
}

/** What the stages that have run came to, in their order. @type {Map<string, Counts & { milliseconds: number }>} */
const outcomes = new Map();

/** @param {string} name @param {Counts & { milliseconds: number }} outcome */
function row(name, { passed, failed, milliseconds }) {
  const cells = [`${passed} passed`.padStart(12), `${failed} failed`.padStart(10), duration(milliseconds).padStart(12)];
  return `${name.padEnd(12)}${cells.join('')}`;
}

await runMain(async () => {
  const options = /** @type {const} */ ({ only: { type: 'string', multiple: true }, list: { type: 'boolean' } });
  const { values } = readArguments({ options }, 'Usage: npm test [-- [--list] [--only STAGE]...]');
  const stages = select(values.only ?? []);
  if (values.list) {
    for (const { name, about } of stages) console.log(`${name.padEnd(12)} ${about}`);
    return;
  }
  requireToolchain();
  const started = performance.now();
  for (const stage of stages) {
    console.log(`\n=== ${stage.name}: ${stage.about}`);
    const start = performance.now();
    const counts = await runStage(stage);
    const outcome = { ...counts, milliseconds: performance.now() - start };
    outcomes.set(stage.name, outcome);
    console.log(row(stage.name, outcome));
  }
  console.log('\n=== All stages, each with what it had to install and build first');
  for (const [name, outcome] of outcomes) console.log(row(name, outcome));
  const sum = (/** @type {'passed' | 'failed'} */ key) =>
    [...outcomes.values()].reduce((total, o) => total + o[key], 0);
  console.log(`\nin ${duration(performance.now() - started)}`);
  console.log(`${sum('passed')} passed, ${sum('failed')} failed`);
  if (sum('failed') > 0) process.exitCode = 1;
});
