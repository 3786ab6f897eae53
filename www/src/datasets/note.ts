/** What is told of a file that was opened, or not used. */
export interface Note {
  file: string;
  reason: string;
}
