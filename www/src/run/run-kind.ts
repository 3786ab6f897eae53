/** What a view of a run says of itself, and what it hands to the views beside it. */
import type { Inputs, Settings } from '../engine/protocol.js';
import type { SpatialInputs } from '../engine/spatial-client.js';
import type { SpatialSettings } from '../engine/spatial-protocol.js';
import type { Noun } from './frame-parts.js';
import type { MenuItem } from '../components/menu.js';
import type { Message } from '../components/messages.js';
import type { Run } from '../components/tools.js';

/** What the header shows of a run. */
export interface ViewFacts {
  title: string;
  /** "10 scans"; empty before anything is there. */
  count: string;
  /** Path of the reference trajectory; empty without. */
  reference: string;
  canExport: boolean;
  /** Another object for every new result. */
  result: unknown;
}

export const NO_FACTS: ViewFacts = { title: '', count: '', reference: '', canExport: false, result: null };

/** A run of the reconstruction, to be compared with its reference. */
export interface GivenFiles {
  /** Null: the reference is still to be dropped. */
  reference: { name: string; bytes: ArrayBuffer } | null;
  estimate: { name: string; text: string };
  /** How the run itself aligns the two. */
  alignment: 'origin' | 'se3';
  /** The run's map, as PLY. */
  readMap: () => Promise<Uint8Array>;
}

/** A recording to compare strategies on. */
export interface GivenRecording {
  title: string;
  inputs: SpatialInputs;
  /** How its frames are read. */
  settings: Partial<SpatialSettings>;
}

/** Planar scans to be located in a map, or to compare strategies on. */
export interface GivenScans {
  title: string;
  inputs: Inputs;
  /** How they are read. */
  settings: Partial<Settings>;
}

/** The recording that was replaced by the one that is open, or that was open before it was undone. */
export interface Former {
  title: string;
  /** Whether the one that is open was brought back, and this one came after it. */
  isUndone: boolean;
  /** Whether the files that are open can be added to it. */
  canJoin: boolean;
}

/** What a view of a run asks of the page's workspace. */
export interface Shelf {
  /** The recording of a robot's stream, where that is open. */
  readonly stream: File | null;
  /** What the recording that this kind of run has open can be exchanged for. */
  formerOf(run: Run): Former | null;
  exchange(): void;
  addInstead(): void;
  forgetFormer(): void;
  /** Brings back what was replaced by files of no use, whose messages are told beside it. Whether there was any. */
  revert(run: Run, messages: readonly Message[]): boolean;
}

/** What is loaded; `num_frames` with those that are not registered yet. */
export interface Loaded extends Pick<ViewFacts, 'title' | 'count' | 'reference'> {
  num_frames: number;
}

/** One of the panels beside or below the map. */
export type Panel = 'figures' | 'table' | 'details' | 'settings';

/** What differs between the two kinds of run. */
export interface RunKind {
  /** Whose settings the page's address holds. */
  kind: Run;
  noun: Noun;
  exports: readonly MenuItem[];
  /** The names of the tabs. */
  panels: Record<Panel, string>;
  /** The panels in the order of their buttons or tabs. */
  order: readonly Panel[];
}

/** Of a robot that was received live. */
export const STREAM: MenuItem = { id: 'stream', label: 'Recording', detail: 'all messages, as MCAP' };

/** The settings stand in the address already. */
export const COPY_LINK: MenuItem = {
  id: 'link',
  label: 'Copy link',
  detail: 'to this page with these settings; files of your own are not in it',
};

export function sameFacts(a: ViewFacts, b: ViewFacts): boolean {
  return (Object.keys(a) as (keyof ViewFacts)[]).every((key) => a[key] === b[key]);
}

// The same empty list every time: a new one would be a change.
export const EMPTY_LIST: readonly never[] = [];
