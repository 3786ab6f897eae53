// @ts-check
/** What `npm run --silent bench > bench.json` writes is JSON, whatever compilers and harnesses print. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { chmodSync, mkdirSync, writeFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { test } from 'node:test';
import { DEADLINE_MS, ROOT, temporaryFolder } from './support.mjs';

/** A compiler that has something to say, and one benchmark as it would build it: of 8 bytes. */
const FILES = {
  'bin/cargo': '#!/bin/sh\necho "cargo $*"\n',
  'target/release/scanstitch-bench': `#!/bin/sh
if [ "$1" = list ]; then printf 'copy\\tcopies 8 bytes\\n'; else printf '8 bytes\\n40 30 20 30\\n'; fi
`,
  'target/bench-pkg/scanstitch_bench.js': `export function initSync() {}
export class PreparedBenchmark { work() { return '8 bytes'; } run() {} }
`,
  'target/bench-pkg/scanstitch_bench_bg.wasm': '',
  'target/wasm32-unknown-unknown/release/scanstitch_bench.wasm': '',
  'target/tools/wasm': '#!/bin/sh\necho "wasm $*"\n',
};

test('the document alone is on stdout, progress on stderr', (t) => {
  const folder = temporaryFolder(t);
  for (const [path, content] of Object.entries(FILES)) {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), content);
    chmodSync(join(folder, path), 0o755);
  }
  const env = {
    ...process.env,
    PATH: `${join(folder, 'bin')}:${process.env.PATH}`,
    CARGO_TARGET_DIR: relative(ROOT, join(folder, 'target')),
    CHROMIUM_PATH: '', // none
  };
  const options = /** @type {const} */ ({ cwd: ROOT, env, encoding: 'utf8', timeout: DEADLINE_MS });
  const { status, stdout, stderr } = spawnSync('npm', ['run', '--silent', 'bench', '--', 'copy'], options);
  assert.equal(status, 0, stderr);
  const [{ name, native }] = JSON.parse(stdout).benchmarks;
  assert.deepEqual([name, native.median_ns, native.rate], ['copy', 30, 266.7]);
  for (const told of [/^> Building the tool/m, /^cargo build /m, /^copy: copies 8 bytes$/m]) assert.match(stderr, told);
});
