/** A map that grows while messages come. Those that come too fast for it are left out of it and counted; the recording has them. */
import type { Message } from '../../../package/live/frames.js';
import type { Snapshot } from '../engine/protocol.js';
import type { SpatialSnapshot } from '../engine/spatial-protocol.js';
import type { PointSet } from '../views/point-layer.js';

/** What the map shows at a moment. */
export interface PlanarShown {
  kind: 'planar';
  frames: Snapshot['result']['frames'];
  points: PointSet;
  lookDirection: number;
}

export interface SpatialShown {
  kind: 'spatial';
  snapshot: SpatialSnapshot;
}

export interface Growth {
  /** Null before the first frame is on the map. */
  readonly shown: PlanarShown | SpatialShown | null;
  readonly numPlaced: number;
  readonly numDropped: number;
  take(message: Message): void;
  dispose(): void;
}

export interface GrowthHooks {
  changed(): void;
  /** A sentence without its full stop. */
  problem(problem: string): void;
}
