// @ts-check
/**
 * Every command that stands in a block of the README or of the docs is run, in the order of its page, in a folder with made-up
 * files of the names that it uses: by a shell where a shell changes its words. Commands within the text name what exists, with
 * options that it has; those that take no longer than a moment are run.
 */
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { chmodSync, copyFileSync, existsSync, mkdirSync, readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { mcapBytes } from './bag_files.mjs';
import { cameraInfo, image, stampAt } from './bag_messages.mjs';
import { SIZE, truthOf, VIEWS, WALK, walkFiles } from './depth_room.mjs';
import { roomLog } from './laser_room.mjs';
import { roomCloud } from './room_clouds.mjs';
import { DEADLINE_MS, ROOM_FILES, ROOM_POSES, ROOT, scanstitch, temporaryFolder } from './support.mjs';

const PAGES = [
  'README.md',
  ...readdirSync(join(ROOT, 'docs'))
    .filter((name) => name.endsWith('.md'))
    .map((name) => `docs/${name}`),
];
/** @type {{ scripts: Record<string, string>, bin: Record<string, string> }} */
const { scripts, bin } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
const DEPTH_TOPIC = '/camera/aligned_depth_to_color/image_raw';

/** @param {string} page */
function blocksOf(page) {
  const text = readFileSync(join(ROOT, page), 'utf8');
  const lines = [...text.matchAll(/^```sh\n([^]*?)^```$/gm)].flatMap(([, block = '']) => block.trim().split('\n'));
  return { text, commands: lines.map((line) => line.replace(/\s+#.*$/, '')) };
}

function bag() {
  const messages = VIEWS.flatMap(({ depth }, i) => {
    const stamp = stampAt(100 + i);
    const time = BigInt(100 + i) * 1_000_000_000n;
    const shape = { width: SIZE, height: SIZE, encoding: '16UC1', data: new Uint8Array(depth.buffer) };
    return [
      { topic: DEPTH_TOPIC, time, data: image({ stamp, ...shape }) },
      {
        topic: '/camera/aligned_depth_to_color/camera_info',
        time,
        data: cameraInfo(stamp, SIZE, SIZE, [SIZE / 2, SIZE / 2, SIZE / 2, SIZE / 2]),
      },
    ];
  });
  const topics = [
    { name: DEPTH_TOPIC, type: 'sensor_msgs/msg/Image' },
    { name: '/camera/aligned_depth_to_color/camera_info', type: 'sensor_msgs/msg/CameraInfo' },
  ];
  return mcapBytes(topics, messages);
}

/** Everything that the docs name, as small as it may be. @param {string} folder */
async function makeWorld(folder) {
  const truth = ROOM_POSES.map(
    ([x, y, theta], i) => `${i} ${x} ${y} 0 0 0 ${Math.sin(theta / 2)} ${Math.cos(theta / 2)}\n`,
  );
  const walk = truthOf(WALK);
  const under = (/** @type {string} */ name, /** @type {Record<string, string | Uint8Array>} */ files) =>
    Object.fromEntries(Object.entries(files).map(([path, content]) => [`${name}/${path}`, content]));
  const long = Array.from({ length: 40 }, (_, i) => `${i} ${0.5 * i} ${Math.sin(i / 5)} 0 0 0 0 1\n`).join('');
  const relations = Array.from({ length: 5 }, (_, i) => `${i} ${i + 1} 0.05 0 0 0 0 0\n`).join('');
  const files = {
    ...under('scans', ROOM_FILES),
    ...under('office', walkFiles()),
    ...under('second_floor', walkFiles()),
    ...under('street', { '0.ply': roomCloud(0), '1.ply': roomCloud(1) }),
    'truth.tum': truth.join(''),
    'mine.tum': truth.join(''),
    'gt.txt': long,
    'est.txt': long.replaceAll(' 0 0 0 0 1', ' 0.01 0 0 0 1'),
    'walk.tum': walk,
    'walk.mcap': bag(),
    'drive.log': roomLog(9),
    'wheels.txt': Array.from({ length: 9 }, (_, i) => `${i} ${0.05 * i} 0 0\n`).join(''),
    'drive.relations': relations,
    'aces.relations': relations,
    'intel.g2o': 'EDGE_SE2 0 1 1 0 0 10 0 0 10 0 100\nEDGE_SE2 1 2 1 0 1 10 0 0 10 0 100\n',
  };
  for (const [path, content] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), content);
  }
  const converted = await scanstitch(['convert', 'walk.tum', 'GT_pose.npy'], folder);
  assert.equal(converted.status, 0, converted.stderr);
  mkdirSync(join(folder, 'hand-ins'));
  for (const name of ['ada.npy', 'bob.npy']) copyFileSync(join(folder, 'GT_pose.npy'), join(folder, 'hand-ins', name));
}

/** The words of a command of ours that a shell would hand on as they stand; null for others. @param {string} command */
function plainWords(command) {
  const [, words] = /^npx scanstitch ([\w ./=:,-]+)$/.exec(command) ?? [];
  return words?.split(/ +/) ?? null;
}

/** A shell in which `npx scanstitch` and `npm run` are those of this clone. @param {string} folder */
function shellOf(folder) {
  const tools = join(folder, 'tools');
  mkdirSync(tools);
  const node = process.execPath;
  const programs = {
    npx: `#!/bin/sh\n[ "$1" = scanstitch ] || exit 9\nshift\nexec "${node}" "${join(ROOT, bin.scanstitch ?? '')}" "$@"\n`,
    npm: `#!/bin/sh\n[ "$1 $2 $3" = "run lesson --" ] || exit 9\nshift 3\nexec "${node}" "${join(ROOT, 'scripts', 'lesson.mjs')}" "$@"\n`,
  };
  for (const [name, text] of Object.entries(programs)) {
    writeFileSync(join(tools, name), text);
    chmodSync(join(tools, name), 0o755);
  }
  const env = { ...process.env, PATH: `${tools}:${process.env.PATH}` };
  const options = /** @type {const} */ ({ encoding: 'utf8', timeout: DEADLINE_MS, killSignal: 'SIGKILL' });
  return (/** @type {string} */ command) => {
    const { status, stderr, error } = spawnSync('sh', ['-c', command], { cwd: folder, env, ...options });
    if (error) throw new Error(`${command}: ${error.message}\n${stderr}`, { cause: error });
    return { status, stderr };
  };
}

/** What is not run in the made-up folder: it runs all of this, or has a test of its own. */
const ELSEWHERE = [
  'npm start',
  'npm test',
  'npx scanstitch live ws://localhost:8765 --seconds 60 --out lap',
  'npx scanstitch localize map.yaml drive.log --out where',
];
/** The pages with commands to run. */
const RUN = PAGES.map((page) => ({
  page,
  own: blocksOf(page).commands.filter((command) => !ELSEWHERE.includes(command)),
})).filter(({ own }) => own.length > 0);

test('commands are found in the blocks of the pages', () => {
  assert.ok(RUN.length >= 7, RUN.map(({ page }) => page).join());
});

for (const { page, own } of RUN) {
  test(
    `the commands of ${page} run`,
    { skip: !process.env.CI && needsElement(own) && 'the element is not built yet' },
    async (t) => {
      const folder = temporaryFolder(t);
      await makeWorld(folder);
      const shell = shellOf(folder);
      const run = async (/** @type {string} */ command) => {
        const words = plainWords(command);
        return words ? scanstitch(words, folder) : shell(command);
      };
      // What an earlier page has computed.
      if (page !== 'docs/laser.md' && own.some((command) => command.includes('aces.relations')))
        await run('npx scanstitch reconstruct drive.log --out result');
      for (const command of own) {
        const { status, stderr } = await run(command);
        assert.equal(status, 0, `${command}\n${stderr}`);
        if (page === 'docs/command_line.md' && command.includes('scans/'))
          await run('npx scanstitch reconstruct office/ --out result');
      }
    },
  );
}

/** @param {string[]} commands */
function needsElement(commands) {
  const isBuilt = existsSync(join(ROOT, 'www', 'dist', 'standalone', 'scanstitch-app.js'));
  return !isBuilt && commands.some((command) => command.startsWith('npm run lesson'));
}

const ofStart = { skip: !process.env.CI && 'it builds; run where CI=true', timeout: DEADLINE_MS };
test('npm start serves the page', ofStart, async (t) => {
  const server = spawn('npm', ['start', '--', '--port', '0'], {
    cwd: ROOT,
    detached: true,
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  t.after(() => process.kill(-(server.pid ?? 0), 'SIGTERM'));
  let output = '';
  // Read to its end: leaving a loop over the stream closes it, and the server ends at its next line.
  await new Promise((resolve, reject) => {
    server.stdout.on('data', (chunk) => {
      output += chunk;
      if (output.includes('The full engine is there')) resolve(undefined);
    });
    server.on('exit', (code) => reject(new Error(`npm start ended with exit code ${code}:\n${output}`)));
  });
  const [address = ''] = /http:\/\/localhost:\d+\S*/.exec(output) ?? [];
  assert.match(await (await fetch(address)).text(), /<scanstitch-app/);
});

/** Commands within the text that are run as they stand. */
const QUICK = ['npx scanstitch settings', 'npm test -- --list'];

test('commands within the text name what exists, with options that it has', async (t) => {
  const all = PAGES.flatMap((page) => [...blocksOf(page).text.matchAll(/`((?:npm|npx|node|cargo) [^`\n]*)`/g)]);
  assert.ok(all.length > 10, `only ${all.length} commands were found`);
  for (const [, written = ''] of all) {
    // Options of node and npm themselves stand before the file or the script.
    const command = written.replace(/^(node|npm run)( --\S+)+/, '$1').replace(/^node npm\/cli\.js/, 'npx scanstitch');
    const [program, first = '', second = ''] = command.split(' ');
    if (program === 'cargo' && first === 'measure') assertHasOptions(command, measuringProgram(second));
    else if (program === 'node') assertHasOptions(command, first);
    else if (program === 'npm' && first === 'run') assertHasOptions(command, scriptOf(second));
    else if (program === 'npm' && ['test', 'start'].includes(first)) assertHasOptions(command, scriptOf(first));
    else if (program === 'npx' && first === 'scanstitch' && /^[a-z]/.test(second)) {
      const { status, stdout } = await scanstitch([second, '--help']);
      assert.equal(status, 0, command);
      for (const [option] of command.matchAll(/ --(?!help)[a-z-]+/g)) assert.ok(stdout.includes(option), command);
    }
  }
  const run = shellOf(temporaryFolder(t));
  for (const command of QUICK) {
    assert.ok(
      all.some(([, found]) => found === command),
      `${command} is no longer in the docs`,
    );
    const { status, stderr } = run(command.replace(/^npm test --/, `node ${join(ROOT, 'scripts', 'test.mjs')}`));
    assert.equal(status, 0, `${command}\n${stderr}`);
  }
});

/** The file that an npm script runs; empty for one that runs another program. @param {string} name */
function scriptOf(name) {
  assert.ok(name in scripts, `npm run ${name}`);
  return /^node (\S+)/.exec(scripts[name] ?? '')?.[1] ?? '';
}

/** The source of one of the programs of crate/measure. @param {string} name */
function measuringProgram(name) {
  const path = join('crate', 'measure', 'src', name);
  return existsSync(join(ROOT, path)) ? join(path, 'mod.rs') : `${path}.rs`;
}

/** @param {string} command @param {string} path of what it runs */
function assertHasOptions(command, path) {
  if (path === '') return;
  assert.ok(existsSync(join(ROOT, path)), command);
  const folder = path.endsWith('/mod.rs') ? dirname(path) : '';
  const paths = folder ? readdirSync(join(ROOT, folder)).map((name) => join(folder, name)) : [path];
  const source = paths.map((one) => readFileSync(join(ROOT, one), 'utf8')).join('\n');
  for (const [, name = ''] of command.matchAll(/ --([a-z][a-z-]*)/g)) {
    const isKnown = path.endsWith('.rs') ? source.includes(`--${name}`) : new RegExp(`\\b'?${name}'?\\b`).test(source);
    assert.ok(isKnown, `${command}: ${path} has no --${name}`);
  }
}
