// @ts-check
/** A generated laser log, for the tests of the command line. */

/** A robot that drives 5 cm a scan ahead in a room with a niche, as CARMEN logs it. @param {number} numScans */
export function roomLog(numScans) {
  const line = (/** @type {unknown} */ _, /** @type {number} */ scan) => {
    const x = 0.05 * scan;
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      const angle = ((beam - 90) * Math.PI) / 180;
      const toSide = (beam < 60 ? 2 : 3) / Math.max(Math.abs(Math.sin(angle)), 1e-9);
      return Math.min(toSide, (4 - x) / Math.max(Math.cos(angle), 1e-9), 50).toFixed(3);
    });
    return `FLASER 180 ${ranges.join(' ')} ${x} 0 0 ${x} 0 0 ${scan} robot ${scan}`;
  };
  return `# a room\n${Array.from({ length: numScans }, line).join('\n')}\n`;
}
