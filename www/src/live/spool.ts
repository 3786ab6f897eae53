/** What comes, as a file: kept in blobs of some megabytes, which browsers move from memory to the disk. */

/** Bytes that are gathered before they become a blob. */
const PART_BYTES = 4 * 2 ** 20;

export class Spool {
  size = 0;
  #parts: Blob[] = [];
  #gathered: Uint8Array<ArrayBuffer>[] = [];
  #numGathered = 0;

  write(bytes: Uint8Array): void {
    this.#gathered.push(bytes as Uint8Array<ArrayBuffer>);
    this.#numGathered += bytes.length;
    this.size += bytes.length;
    if (this.#numGathered >= PART_BYTES) this.#flush();
  }

  file(name: string): File {
    this.#flush();
    return new File(this.#parts, name);
  }

  #flush(): void {
    this.#parts.push(new Blob(this.#gathered));
    this.#gathered = [];
    this.#numGathered = 0;
  }
}
