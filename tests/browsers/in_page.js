/**
 * What a user does, as scripts of the page: run in every browser, they answer with what is seen. `host.html` loads this beside
 * the element.
 */
const app = document.querySelector('scanstitch-app');
const done = [];
const faults = [];
addEventListener('scanstitch-done', ({ detail }) => done.push(detail));
addEventListener('error', ({ message }) => faults.push(message));
addEventListener('unhandledrejection', ({ reason }) => faults.push(String(reason)));

const WAIT_MS = 120_000;

async function until(look, what) {
  const end = Date.now() + WAIT_MS;
  for (let seen = look(); ; seen = look()) {
    if (seen) return seen;
    if (Date.now() > end) throw new Error(`${what} did not come`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

/** All elements of this selector, in shadow trees as well. */
function everywhere(selector, root = document) {
  const inside = [...root.querySelectorAll('*')].flatMap(({ shadowRoot }) =>
    shadowRoot ? everywhere(selector, shadowRoot) : [],
  );
  return [...root.querySelectorAll(selector), ...inside];
}

const button = (words) =>
  everywhere('button, [role=menuitem]').find(
    (one) => words.test(one.textContent.trim() || one.ariaLabel || '') && one.getClientRects().length > 0,
  );

async function press(words) {
  (await until(() => button(words), `the button ${words}`)).click();
}

/** Files as if they had been chosen: by name, from addresses. */
async function choose(files, input = () => everywhere('#pick-files')[0]) {
  const transfer = new DataTransfer();
  for (const [name, address] of files) {
    const response = await fetch(address);
    transfer.items.add(new File([await response.blob()], name));
  }
  const picker = input();
  picker.files = transfer.files;
  picker.dispatchEvent(new Event('change'));
}

/** What the next run that ends has found, or that of this number; poses to the last bit. */
async function run(start, count = done.length) {
  const begin = performance.now();
  await start();
  const { result, elapsed_ms } = await until(() => done[count], 'the result');
  const poses = result.frames.map(({ T_world_sensor }) => T_world_sensor);
  return {
    ms: Math.round(performance.now() - begin),
    elapsed_ms,
    seen: { status: result.frames.map(({ status }) => status).join(' '), poses },
  };
}

const scans = Array.from({ length: 10 }, (_, i) => [`${i}.ply`, `${i}.ply`]);

/** Of the files that a press of this item writes: the last one's text. */
async function exported(words) {
  const blobs = [];
  const { createObjectURL } = URL;
  URL.createObjectURL = (blob) => {
    blobs.push(blob);
    return createObjectURL.call(URL, blob);
  };
  try {
    await press(/^Export$/);
    await press(words);
    return (await until(() => blobs.at(-1), 'the file')).text();
  } finally {
    URL.createObjectURL = createObjectURL;
  }
}

window.scenarios = {
  sample: () => run(() => undefined, 0),
  'ten scans': () => run(() => choose(scans)),
  export: async () => ({ ms: 0, seen: { trajectory: await exported(/^Trajectory.*TUM/s) } }),
  'depth images in a ZIP': () => run(() => choose([['room.zip', 'depth.zip']])),
  'a bag of laser scans': () => run(() => choose([['scans.mcap', 'scans.mcap']])),
  'ICP lab': async () => {
    const begin = performance.now();
    await press(/^ICP$/);
    const lab = await until(() => everywhere('scanstitch-lab')[0], 'the lab');
    const pair = ['1.ply', '0.ply'].map((name) => [name, name]);
    await until(() => everywhere('#pick', lab.shadowRoot ?? document)[0], 'the input');
    await choose(pair, () => everywhere('#pick', lab.shadowRoot)[0]);
    // The lab opens with scans of the last run, which are at their start as well.
    await until(() => everywhere('.pair select', lab.shadowRoot)[0]?.value === '1.ply', 'the pair');
    await until(() => everywhere('h2').some((one) => one.textContent === 'At the start'), 'the trace');
    const read = () => everywhere('dl.facts', lab.shadowRoot)[0]?.textContent.replace(/\s+/g, ' ').trim();
    const at_start = await until(read, 'the figures');
    await press(/^One iteration on/);
    await until(() => everywhere('h2').some((one) => one.textContent === 'After iteration 1'), 'the iteration');
    // The figures of the start stay until those of the iteration are there: their cost is compared with itself by then.
    const is_read = (figures) => figures && figures.replace(/ m² \S*0 %/, ' m²') !== at_start && figures;
    const figures = await until(() => is_read(read()), 'the figures of the iteration');
    return { ms: Math.round(performance.now() - begin), seen: { figures } };
  },
};
/** A recording from its ZIP, not drawn: without a graphics card its emulation would be timed. */
window.timed = async (address) => {
  for (const name of ['drawArrays', 'drawElements']) window.WebGL2RenderingContext.prototype[name] = () => undefined;
  const { elapsed_ms, seen } = await run(() => choose([['recording.zip', address]]));
  return { elapsed_ms, status: seen.status, poses: JSON.stringify(seen.poses) };
};
window.look = async (name) => ({ ...(await window.scenarios[name]()), faults: faults.splice(0) });
window.lacks = () => ({
  WebGL2: document.createElement('canvas').getContext('webgl2') === null,
  OffscreenCanvas: typeof OffscreenCanvas === 'undefined',
});
app.hidden = false;
