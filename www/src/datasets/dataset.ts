/** A set of inputs: where it comes from, what is in it, what was not used. Plain values; every change is a new one. */
import type { Mended } from '../../../package/files/recording.js';
import type { OpenedRecording } from '../../../package/recording_reader.js';
import type { InputFile, Inputs } from '../engine/protocol.js';

/** Where a data set comes from. A sample, or what the host page names, is never extended by the user's files. */
export type Origin = 'sample' | 'host' | 'user';

/** What was opened, and how the page calls it; empty: after its folder. */
export interface Opened {
  title: string;
  origin: Origin;
  recording: OpenedRecording;
}

export interface Dataset extends Inputs {
  /** How the page calls it. */
  title: string;
  origin: Origin;
  /** What a workbench keeps of its map, until that is computed. */
  mended?: Mended | undefined;
}

/** Whether there is a log of many scans among them: a recording that is whole. */
export const hasLog = (scans: readonly InputFile[]): boolean => scans.some(({ isLog }) => isLog);
