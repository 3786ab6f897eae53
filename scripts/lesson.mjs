// @ts-check
/**
 * `npm run lesson -- lesson.html FILES`: one HTML file that holds the element and a recording, and fetches nothing. It runs in
 * frames without an origin, as learning platforms use, and from the disk.
 */
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { basename } from 'node:path';
import { buildStandalone, ELEMENT } from './engine.mjs';
import { readArguments, runMain, StepError } from './steps.mjs';

const USAGE = 'Usage: npm run lesson -- PAGE.html FILE... [--title TEXT] [--settings NAME=VALUE&...]';

/** @param {string} text */
function inHtml(text) {
  return text.replaceAll('&', '&amp;').replaceAll('"', '&quot;').replaceAll('<', '&lt;');
}

/** @param {string} path */
function addressOf(path) {
  if (!existsSync(path)) throw new StepError(`${path}: there is no such file.`);
  const bytes = readFileSync(path).toString('base64');
  return `data:application/octet-stream;name=${encodeURIComponent(basename(path))};base64,${bytes}`;
}

/**
 * @param {string} element the script of the element
 * @param {string[]} files paths
 * @param {{ title: string, settings: string }} options
 */
export function lessonPage(element, files, { title, settings }) {
  return `<!doctype html>
<html lang="en">
  <meta charset="utf-8" />
  <title>${inHtml(title)}</title>
  <style>body { margin: 0 } scanstitch-app { height: 100vh }</style>
  <scanstitch-app src="${inHtml(JSON.stringify(files.map(addressOf)))}" settings="${inHtml(settings)}">
    <b slot="title">${inHtml(title)}</b>
  </scanstitch-app>
  <script>
    // The page around the frame hears what the element tells.
    for (const type of ['scanstitch-progress', 'scanstitch-done', 'scanstitch-error']) {
      addEventListener(type, ({ detail }) => parent.postMessage({ type, detail }, '*'));
    }
  </script>
  <script src="data:text/javascript;base64,${Buffer.from(element).toString('base64')}"></script>
</html>
`;
}

if (process.argv[1] === import.meta.filename) {
  await runMain(async () => {
    const options = /** @type {const} */ ({
      title: { type: 'string', default: 'Scanstitch' },
      settings: { type: 'string', default: '' },
    });
    const { values, positionals } = readArguments({ options, allowPositionals: true }, USAGE);
    const [page, ...files] = positionals;
    if (page === undefined || files.length === 0 || !page.endsWith('.html')) throw new StepError(USAGE);
    if (!existsSync(ELEMENT)) await buildStandalone();
    writeFileSync(page, lessonPage(readFileSync(ELEMENT, 'utf8'), files, values));
    console.log(`${page}: ${(readFileSync(page).length / 1e6).toFixed(1)} MB, ${files.length} files`);
  });
}
