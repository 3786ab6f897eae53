/** Planar scans, by the full engine. */
import * as engine from './package.js';
import { servePlanar } from './planar-thread.js';

servePlanar(engine);
