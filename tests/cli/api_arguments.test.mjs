// @ts-check
/** Arguments of another type than the API's are refused, and never lead out of the engine's memory. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as api from '../../npm/index.js';
import { asciiPly } from './support.mjs';

await api.load();

const CLOUD = new TextEncoder().encode(asciiPly([[0, 0, 0], [1, 0, 0], [0, 1, 0]])); // prettier-ignore
const TUM = new TextEncoder().encode('0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n');
const ODD = /** @type {unknown[]} */ ([
  ...[undefined, null, {}, [], '', 'x', -1, 1e12, Number.NaN, true, 3n, Symbol('s'), () => 1, [1, 'a', {}]],
  ...[new Uint8Array(3), new Float64Array(7), { length: 3 }, { length: -1 }, '__proto__'],
]);

test('a name that is no string, bytes that are none', () => {
  const read = /** @type {(...args: unknown[]) => unknown} */ (api.PointCloud.read);
  assert.throws(() => read(CLOUD, {}), { name: 'TypeError', message: 'expected a string, not Object' });
  assert.throws(() => read('ply', 'a.ply'), { name: 'TypeError', message: 'expected a Uint8Array, not String' });
  assert.throws(() => read({ length: 2 ** 30 }, 'a.ply'), TypeError);
  assert.equal(api.PointCloud.read(CLOUD, 'a.ply').length, 3);
});

test('every function and method with arguments of every kind', () => {
  let state = 1;
  const random = (/** @type {number} */ limit) => {
    state = (Math.imul(state, 1_103_515_245) + 12_345) >>> 0;
    return (state >>> 8) % limit;
  };
  const args = () => Array.from({ length: random(6) }, () => ODD[random(ODD.length)]);
  let numCalls = 0;
  const attempt = (/** @type {string} */ what, /** @type {(...args: any[]) => unknown} */ call) => {
    numCalls += 1;
    try {
      call(...args());
    } catch (error) {
      assert.ok(!(error instanceof WebAssembly.RuntimeError), `${what}: ${/** @type {Error} */ (error).stack}`);
    }
  };
  /** @type {Record<string, () => any>} */
  const made = {
    PointCloud: () => api.PointCloud.read(CLOUD, 'a.ply'),
    Trajectory: () => api.Trajectory.read(TUM, 'a.tum'),
    Reconstruction: () => {
      const reconstruction = new api.Reconstruction();
      reconstruction.add_scan('a.ply', CLOUD);
      return reconstruction;
    },
    SpatialReconstruction: () => new api.SpatialReconstruction(),
    FrameClouds: () => new api.FrameClouds(),
  };
  const functionsOf = (/** @type {any} */ object) =>
    Object.getOwnPropertyNames(object).filter((name) => {
      const { value } = Object.getOwnPropertyDescriptor(object, name) ?? {};
      return typeof value === 'function' && !['constructor', 'free', '__wrap', '__destroy_into_raw'].includes(name);
    });
  for (let round = 0; round < 20; round += 1) {
    for (const [name, value] of /** @type {[string, any][]} */ (Object.entries(api))) {
      if (typeof value !== 'function' || name === 'load') continue;
      if (!Function.prototype.toString.call(value).startsWith('class')) {
        attempt(name, value);
        continue;
      }
      for (const method of functionsOf(value)) attempt(`${name}.${method}`, value[method].bind(value));
      attempt(`new ${name}`, (...args) => new value(...args));
      const object = made[name]?.();
      for (const method of object ? functionsOf(value.prototype) : []) {
        attempt(`${name}#${method}`, (...args) => object[method](...args));
      }
      object?.free();
    }
  }
  assert.ok(numCalls > 1500, `${numCalls} calls`);
});
