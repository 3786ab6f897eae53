/** The part of the engine that the page begins with, a file of its own: what `package.ts` is for all of it. */
export * from '../../../pkg/scanstitch_planar.js';
export { default as init } from '../../../pkg/scanstitch_planar.js';
