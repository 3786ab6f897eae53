/**
 * The engine: the one module of the page that imports the package that Rust was compiled into. Workers call it; all other
 * modules take types from here, and nothing else.
 */
export * from '../../../pkg/scanstitch.js';
export { default as init } from '../../../pkg/scanstitch.js';
