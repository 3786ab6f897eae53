/** The package's vectors, for the views. */
export * from '../../../package/base/vectors.js';
