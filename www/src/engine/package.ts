/**
 * The full engine: the module that imports the package that Rust was compiled into. Its part for planar scans is
 * planar-package.ts. Workers call it; all other modules take types from here, and nothing else.
 */
export * from '../../../pkg/scanstitch.js';
export { default as init } from '../../../pkg/scanstitch.js';
