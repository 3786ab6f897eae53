/** Which of the given files are scans, which one is the reference trajectory, and why the rest is left aside. */
export { classify } from '../../../npm/recording/classify.js';
