/** What a module that reads a format is given, and gives. */
import type { Note } from '../base/errors.js';
import type { Content } from '../files/content.js';

/** A file that is made of another one when it is read, with its path and size unless they are changed. */
type MadeOf = (file: Content, make: () => Promise<Uint8Array>, changes?: Partial<Content>) => Content;
/** Throws a ScanstitchError where the file cannot be used. */
export type Convert = (file: Content, tools: { madeOf: MadeOf; notes: Note[] }) => Promise<Content | Content[]>;
