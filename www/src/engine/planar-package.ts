/** The part of the engine that the page loads first, in a separate file; `package.ts` is its counterpart for the full engine. */
export * from '../../../pkg/scanstitch_planar.js';
export { default as init } from '../../../pkg/scanstitch_planar.js';
