/** Planar scans, by the part of the engine that the page begins with. */
import * as engine from './planar-package.js';
import { servePlanar } from './planar-thread.js';

servePlanar(engine);
