// @ts-check
/**
 * `npm test`: everything that can be checked, each stage with its counts and duration, and as the last line the sum,
 * `N passed, N failed`, and `N skipped` where something that a test needs is absent. A stage that fails does not stop the
 * later ones; the exit code tells.
 * `npm test -- --only NAME` runs one stage (more with more `--only`), `--only lint` all checks that run no test,
 * `--list` names them.
 */
import {
  copyFileSync,
  existsSync,
  mkdirSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from 'node:fs';
import { availableParallelism, tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { afterSecondTry, believe, countCargo, countNode, countPlaywright, noWarnings } from './counts.mjs';
import { buildPackage, buildPart, buildTools } from './engine.mjs';
import { say } from './progress.mjs';
import { failuresOf, runStages, sumOf, tableOf } from './stages.mjs';
import {
  answers,
  capture,
  commandSeconds,
  duration,
  ensureNodeModules,
  ensureRustLinters,
  ensureWasmTarget,
  findChromium,
  findHeadlessChromium,
  findProgram,
  prependPath,
  readArguments,
  requireToolchain,
  ROOT,
  run,
  runMain,
  StepError,
  step,
  TARGET_DIR,
  WASM_TARGET,
} from './steps.mjs';

const isCI = process.env.CI === 'true';
/** Where everything is built once, what would speed up the next time only costs. */
if (isCI) {
  process.env.CARGO_INCREMENTAL ??= '0';
  // A crate in one piece takes a fifth less work than in sixteen, of which each compiles what it inlines; but one processor at a time.
  process.env.CARGO_PROFILE_DEV_CODEGEN_UNITS ??= '1';
}
/**
 * Clippy as compiler of the packages here, in place of `cargo clippy`, which would look through all dependencies anew. Not of the
 * engine in pkg/: it leaves optimisations out.
 */
const BY_CLIPPY = { RUSTC_WORKSPACE_WRAPPER: 'clippy-driver', CARGO_TERM_COLOR: 'never' };
/** All packages but the tools that make WebAssembly, which have a profile of their own and a hundred dependencies. */
const ENGINE = ['--workspace', '--exclude', 'xtask'];
const RUST_BUILD = ['build', ...ENGINE, '--lib', '--bins', '--tests'];
const RUST_TEST = ['test', ...ENGINE, '--no-fail-fast'];
/** As wasm-pack does; where it does not run, nothing has to be generated. To optimise these tests takes longer than it saves. */
const WASM_TESTS = [isCI ? 'build' : 'check', '--tests', '--target', WASM_TARGET];
const WASM_TEST_ENV = { ...BY_CLIPPY, CARGO_PROFILE_DEV_OPT_LEVEL: '0', CARGO_INCREMENTAL: '0' };
/** Seconds for the driver of the browser to answer, and for a whole run: by default 5 and 20, too few on a busy machine. */
const WASM_TEST_DEADLINES = { WASM_BINDGEN_TEST_DRIVER_TIMEOUT: '60', WASM_BINDGEN_TEST_TIMEOUT: '300' };
/** An empty project has our folder and our profile for dependencies: what the two share is compiled once. */
const CONSUMER_ENV = {
  CARGO_TARGET_DIR: TARGET_DIR,
  CARGO_PROFILE_DEV_OPT_LEVEL: '1',
  CARGO_PROFILE_DEV_DEBUG: 'false',
  CARGO_PROFILE_DEV_BUILD_OVERRIDE_OPT_LEVEL: '0',
};
/** More tests of the page than this fail for a reason (of some 320; by chance it was none, one or two in each run). */
const MOST_BY_CHANCE = 3;
const CLI_TESTS = join('tests', 'cli');
/** It begins with the engine's memory as it is loaded. */
const MEMORY_TEST = 'memory.test.mjs';
/** So many processes, of which the last to end does not keep the others waiting. */
const NUM_CLI_GROUPS = 6;
const PRETTIER_CACHE = ['--cache-location', join(TARGET_DIR, 'prettier')];

/** Node 20 before 20.10 knows no such option, and runs one file less at a time than there are processors. */
const NODE_TESTS_AT_A_TIME = answers(process.execPath, ['--test-concurrency=2', '--version'])
  ? [`--test-concurrency=${Math.max(2, availableParallelism() - 1)}`]
  : [];

/** @typedef {import('./stages.mjs').Counts} Counts */
/** @typedef {import('./stages.mjs').Task} Task */
/** @typedef {import('./stages.mjs').Stage} Stage */

/** @type {Counts} */
const NONE = { passed: 0, failed: 0, skipped: 0 };

// What stages need.

/** @type {Task} */
const nodeModules = { name: 'node modules', about: 'npm ci', busy: 0, run: ensureNodeModules };
/** @type {Task} */
const rustLinters = { name: 'Rust linters', about: 'rustfmt and clippy', busy: 0, run: ensureRustLinters };
/** @type {Task} */
const wasmTarget = {
  name: 'Rust target',
  about: 'the standard library for WebAssembly',
  busy: 0,
  needs: [rustLinters], // rustup does one thing at a time
  run: ensureWasmTarget,
};

/** Where wasm-pack runs, with it and the tools that it needs: they share what is compiled. */
const tools = once(() => buildTools({ withTestRunner: isCI, env: BY_CLIPPY, isUrgent: true }));

/** @type {Task} */
const planarEngine = {
  name: 'planar engine',
  about: 'the part of the engine that the page begins with, into pkg/',
  needs: [wasmTarget],
  folder: 'quick',
  // Compiled beside the tools: they are needed at its end.
  run: () => buildPart('planar', 'quick', tools()),
};
/** @type {Task} */
const engine = {
  name: 'engine',
  about: 'the full engine, into pkg/',
  needs: [planarEngine],
  folder: 'quick',
  run: () => buildPart('full', 'quick', tools()).then(() => buildPart('formats', 'quick', tools())),
};
/** @type {Task} */
const packageFiles = {
  name: 'package',
  about: 'what is emitted into npm/',
  needs: [nodeModules, engine],
  run: buildPackage,
};
/** @type {Task} */
const chromium = { name: 'Chromium', about: 'Chromium and its driver', busy: 0, run: installChromium };
/** @type {Task} */
const otherBrowsers = {
  name: 'other browsers',
  about: 'Firefox and WebKit, where CI=true',
  busy: 0,
  needs: [chromium], // apt does one thing at a time
  run: installOtherBrowsers,
};

/** @type {Stage} */
const build = {
  name: 'build',
  about: 'npm run build',
  needs: [packageFiles],
  folder: 'quick',
  // Without a page there is nothing to test: what needs it is not run.
  run: async () => {
    await run('npm', ['run', '--silent', 'build', '--', '--quick']);
    return { ...NONE, passed: 1 };
  },
};

/** @type {Stage} */
const clippyTools = {
  name: 'clippy-tools',
  about: 'the tools compile and clippy finds nothing in them',
  lint: true,
  needs: [rustLinters],
  folder: 'tools',
  run: async () => noWarnings({ code: 0, output: await tools() }),
};
/** @type {Stage} */
const clippy = {
  name: 'clippy',
  about: 'the engine and its tests compile and clippy finds nothing in them',
  lint: true,
  needs: [rustLinters],
  folder: 'debug',
  run: async () => noWarnings(await capture('cargo', RUST_BUILD, { env: BY_CLIPPY, echo: true })),
};
/** @type {Stage} */
const docs = {
  name: 'docs',
  about: 'the Rust documentation builds, and its links lead somewhere',
  lint: true,
  needs: [rustLinters],
  folder: 'debug',
  run: () => succeeds(['cargo', 'doc', '--no-deps', '--lib', ...ENGINE], { RUSTDOCFLAGS: '-D warnings' }),
};
/** @type {Stage} */
const clippyWasm = {
  name: 'clippy-wasm',
  about: 'the same of the WebAssembly build',
  lint: true,
  needs: [rustLinters, wasmTarget, clippy],
  folder: 'debug',
  run: async () => noWarnings(await capture('cargo', WASM_TESTS, { env: WASM_TEST_ENV, echo: true })),
};

/**
 * What stands first begins first where several could. Of a folder of cargo, each compiles with the same profile, packages and
 * features, or cargo starts anew.
 * @type {Stage[]}
 */
const STAGES = [
  clippyTools,
  build,
  {
    name: 'e2e',
    about: 'the built page in Chromium',
    needs: [build, chromium],
    busy: 2, // as many tests at a time
    run: playwrightTests,
  },
  clippy,
  {
    name: 'rust',
    about: 'native tests',
    needs: [clippy], // which compiles them
    run: rustTests,
  },
  {
    name: 'cli',
    about: 'the command line and the npm package',
    needs: [build],
    run: nodeTests,
  },
  {
    name: 'browsers',
    about: 'the built page in Firefox and WebKit, where they are installed; where CI=true they are installed first',
    needs: [build, otherBrowsers],
    run: browserTests,
  },
  clippyWasm,
  docs,
  ...(isCI ? [crateTested(), wasmPackTested()] : []),
  lint('format', 'Rust is formatted', ['cargo', 'fmt', '--all', '--check'], { needs: [rustLinters], busy: 0 }),
  lint(
    'prettier',
    'JavaScript, TypeScript, HTML and CSS are formatted',
    // What it found in a file holds for as long as the file's bytes and its own version and options do.
    [
      'npx',
      'prettier',
      '--check',
      '--log-level',
      'warn',
      '--cache',
      '--cache-strategy',
      'content',
      ...PRETTIER_CACHE,
      '.',
    ],
    { needs: [nodeModules] },
  ),
  lint(
    'promises',
    'no promise is left without anybody waiting for it',
    ['npx', 'oxlint', '--type-aware', 'www/src', 'package', 'scripts', 'tests/cli', 'tests/e2e'],
    { needs: [packageFiles] },
  ),
  // Those of the package are checked where it is emitted.
  lint('types', 'types of the package, scripts and tests', ['npx', 'tsc', '--project', '.'], { needs: [packageFiles] }),
  lint('types-page', 'types of the page', ['npx', 'tsc', '--project', 'www'], { needs: [nodeModules, engine] }),
  {
    name: 'advisories',
    about: 'no package with a known flaw is used, where the registries answer',
    lint: true,
    busy: 0,
    needs: [nodeModules],
    run: advisories,
  },
];

/**
 * The command that people type. Elsewhere than in continuous integration, the same is tested on pkg/ by the stage `cli`.
 * @returns {Stage}
 */
function wasmPackTested() {
  return {
    name: 'wasm-pack',
    about: 'tests of the WebAssembly build in headless Chromium: wasm-pack test --headless --chrome',
    needs: [clippyTools, clippyWasm, chromium],
    folder: 'debug',
    run: wasmPackTests,
  };
}

/**
 * What `cargo add scanstitch` brings. Its dependencies are those that `docs` has checked.
 * @returns {Stage}
 */
function crateTested() {
  return {
    name: 'crate',
    about: 'the crate as it is published compiles in an empty project, with the example of docs/api.md',
    needs: [docs],
    folder: 'debug',
    run: crateTests,
  };
}

/**
 * A stage that runs no test: one command, one check.
 * @param {string} name
 * @param {string} about
 * @param {string[]} command
 * @param {Partial<Task>} [more]
 * @returns {Stage}
 */
function lint(name, about, command, more = {}) {
  return { ...more, name, about, lint: true, run: () => succeeds(command) };
}

/**
 * @template T
 * @param {() => Promise<T>} work
 * @returns {() => Promise<T>} does it the first time it is asked
 */
function once(work) {
  /** @type {Promise<T> | null} */
  let done = null;
  return () => (done ??= work());
}

/** @param {string[]} command @param {NodeJS.ProcessEnv} [env] */
async function succeeds([program = '', ...args], env = {}) {
  const { code } = await capture(program, args, { env, echo: true });
  return code === 0 ? { ...NONE, passed: 1 } : { ...NONE, failed: 1 };
}

/** `npm audit` and `cargo deny`; skipped, and said so, where they cannot answer. */
async function advisories() {
  const audit = await capture('npm', ['audit', '--json', '--omit=dev'], { echo: false });
  const report = readJson(audit.output);
  const found = report?.metadata?.vulnerabilities?.total;
  if (found === undefined) say('npm audit: skipped, the registry gives no answer');
  else if (found > 0) say(audit.output);
  const npm = found === undefined ? { skipped: 1 } : found > 0 ? { failed: 1 } : { passed: 1 };
  if (!answers('cargo', ['deny', '--version'])) {
    say('cargo deny: skipped, it is not installed (cargo install cargo-deny --locked)');
    return { ...NONE, ...npm, skipped: ('skipped' in npm ? 1 : 0) + 1 };
  }
  const deny = await capture('cargo', ['deny', '--offline', 'check', 'bans', 'sources'], { echo: true });
  const isClean = deny.code === 0;
  return {
    passed: ('passed' in npm ? 1 : 0) + Number(isClean),
    failed: ('failed' in npm ? 1 : 0) + Number(!isClean),
    skipped: 'skipped' in npm ? 1 : 0,
  };
}

/** What lies between the first brace and the last: warnings may stand around it. @param {string} text */
function readJson(text) {
  try {
    return JSON.parse(text.slice(text.indexOf('{'), text.lastIndexOf('}') + 1));
  } catch {
    return null;
  }
}

// What the stages need is installed.

/** Chromium and its driver; and Chromium without windows, with which the tests of the page take less time. */
async function installChromium() {
  if (!answers('chromedriver') || !findChromium()) await installChromiumItself();
  if (findHeadlessChromium() !== findChromium() || !canInstall()) return;
  try {
    await install('Chromium without windows', ['chromium-headless-shell']);
  } catch (error) {
    if (!(error instanceof StepError)) throw error;
    say('It is not to be had here: the tests run in Chromium.');
  }
}

async function installChromiumItself() {
  const packages = ['chromium', 'chromium-driver'];
  if (!canInstall()) {
    throw new StepError(
      'Chromium and its driver are missing, and only root can install them. On Debian: sudo apt-get install ' +
        `--no-install-recommends ${packages.join(' ')}\n` +
        'Elsewhere, put `chromium` or `google-chrome` and `chromedriver` of the same version on the PATH.',
    );
  }
  await install('Chromium and its driver', packages);
}

/** Firefox and WebKit, in continuous integration. Elsewhere their tests are skipped and counted where they are missing. */
async function installOtherBrowsers() {
  if (!isCI || !canInstall()) return;
  if (findProgram(['firefox-esr', 'firefox']) && answers('WebKitWebDriver') && answers('xvfb-run', ['--help'])) return;
  await install('Firefox and WebKit', ['firefox-esr', 'webkit2gtk-driver', 'xvfb', 'xauth']);
}

const canInstall = () => process.getuid?.() === 0 && answers('apt-get');

/** What Debian has now: read once for all that is installed. */
const updatePackageLists = once(() => run('apt-get', ['update', '--quiet=2']));

/** @param {string} what @param {string[]} packages of Debian */
async function install(what, packages) {
  await step(`Installing ${what} (apt)`, async () => {
    const env = { DEBIAN_FRONTEND: 'noninteractive' };
    await updatePackageLists();
    await run('apt-get', ['install', '--yes', '--quiet=2', '--no-install-recommends', ...packages], { env });
  });
}

// The runners, and what they count.

async function rustTests() {
  const tests = await capture('cargo', [...RUST_TEST, '--tests'], { env: BY_CLIPPY, echo: true });
  const docs = await capture('cargo', [...RUST_TEST, '--doc'], { env: BY_CLIPPY, echo: true });
  return believe(countCargo(tests.output + docs.output), tests.code || docs.code);
}

/** What the example computes, its doctest asserts (crate/src/lib.rs). */
async function crateTests() {
  const { version } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  const [, example] = /^```rust\n([^]*?)^```$/m.exec(readFileSync(join(ROOT, 'docs', 'api.md'), 'utf8')) ?? [];
  if (!example?.includes('fn main')) throw new StepError('docs/api.md has no program in Rust.');
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-crate-'));
  const cargo = (/** @type {string[]} */ args, /** @type {string} */ cwd) =>
    run('cargo', [...args, '--offline', '--quiet'], { cwd, env: CONSUMER_ENV });
  try {
    await cargo(['package', '--no-verify', '--allow-dirty', '--package', 'scanstitch'], ROOT);
    const [packed, project] = [`scanstitch-${version}`, join(folder, 'consumer')];
    await run('tar', ['-xzf', join(TARGET_DIR, 'package', `${packed}.crate`)], { cwd: folder });
    await cargo(['init', '--name', 'consumer', 'consumer'], folder);
    await cargo(['add', '--path', join('..', packed)], project);
    copyFileSync(join(folder, packed, 'Cargo.lock'), join(project, 'Cargo.lock'));
    writeFileSync(join(project, 'src', 'main.rs'), example);
    await cargo(['check'], project);
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
  return { ...NONE, passed: 1 };
}

/** With the tools of crate/xtask: wasm-pack would build the locked wasm-bindgen for minutes if it were not on the PATH. */
async function wasmPackTests() {
  prependPath(join(TARGET_DIR, 'tools'));
  const env = { ...WASM_TEST_ENV, ...WASM_TEST_DEADLINES };
  const { code, output } = await capture('wasm-pack', ['test', '--headless', '--chrome'], { env, echo: true });
  return believe(countCargo(output), code);
}

/** Several files share a process, in which the engine is compiled and optimised once. */
async function nodeTests() {
  const names = readdirSync(join(ROOT, CLI_TESTS)).filter((name) => name.endsWith('.test.mjs'));
  const folder = join(TARGET_DIR, 'cli');
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  const together = names.filter((name) => name !== MEMORY_TEST);
  const groups = [
    [MEMORY_TEST],
    ...Array.from({ length: NUM_CLI_GROUPS }, (_, group) =>
      together.filter((_, index) => index % NUM_CLI_GROUPS === group),
    ),
  ];
  const files = groups.map((group, index) => {
    const imports = group.map((name) => `import ${JSON.stringify(pathToFileURL(join(ROOT, CLI_TESTS, name)))};\n`);
    writeFileSync(join(folder, `${index}.test.mjs`), imports.join(''));
    return join(folder, `${index}.test.mjs`);
  });
  const args = ['--test', ...NODE_TESTS_AT_A_TIME, '--test-reporter=spec', ...files];
  const { code, output } = await capture(process.execPath, args, { echo: true });
  return believe(countNode(output), code);
}

/**
 * A page with a clock, workers and a renderer beside a compiler: what fails there is tried once more, one test at a time. What
 * passes then is named as unsteady at the end; what fails always still does. Many do not fail by chance.
 */
async function playwrightTests() {
  const first = await playwright([]);
  if (first.failed === 0 || first.failed > MOST_BY_CHANCE || first.failures?.length !== first.failed) return first;
  say('\nTried again, one at a time:');
  return afterSecondTry(first, await playwright(['--last-failed', '--workers=1']));
}

/** @param {string[]} options */
async function playwright(options) {
  mkdirSync(TARGET_DIR, { recursive: true });
  const report = join(TARGET_DIR, 'e2e.json');
  rmSync(report, { force: true });
  const command = ['playwright', 'test', ...options];
  const { code } = await capture('npx', command, { env: { E2E_REPORT: report }, echo: true });
  return believe(existsSync(report) ? countPlaywright(readFileSync(report, 'utf8')) : NONE, code);
}

async function browserTests() {
  // Node 20 has the WebSocket that Firefox is spoken to by, but only if asked for.
  const args = ['--experimental-websocket', 'tests/browsers/run.mjs'];
  const { code, output } = await capture(process.execPath, args, { echo: true });
  return believe(countNode(output), code);
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
  const outcomes = await runStages(stages);
  say('\n=== All stages, and what they needed');
  tableOf(stages, outcomes).forEach(say);
  const { line, failed } = sumOf(outcomes.values());
  const seconds = commandSeconds();
  const processors = seconds === null ? '' : `, ${seconds.toFixed(0)} s of processor time`;
  const failures = failuresOf(outcomes);
  if (failures.length > 0) say(['\n=== What failed', ...failures].join('\n'));
  say(`\nin ${duration(performance.now() - started)}${processors}`);
  say(line);
  if (failed > 0) process.exitCode = 1;
});
