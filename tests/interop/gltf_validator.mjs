// Usage: node gltf_validator.mjs VALIDATOR FILE...
//
// Validates files with the package in the folder VALIDATOR, and prints how often each code came.

import {readFileSync} from "node:fs";
import {createRequire} from "node:module";

// What the validator says of an extension that it does not know, and of each attribute with its prefix.
const EXPECTED = {UNSUPPORTED_EXTENSION: 1, MESH_PRIMITIVE_INVALID_ATTRIBUTE: 19};

const [folder, ...files] = process.argv.slice(2);
const {validateBytes, version} = createRequire(import.meta.url)(folder);
let wrong = files.length === 0;
for (const file of files) {
    const {issues} = await validateBytes(new Uint8Array(readFileSync(file)), {maxIssues: 0});
    const codes = {};
    for (const {code} of issues.messages) codes[code] = (codes[code] ?? 0) + 1;
    console.log(`gltf-validator ${version()}: ${file.replace(/.*\//, "")}: ${JSON.stringify(codes)}`);
    for (const {code, message, pointer} of issues.messages)
        if (!(code in EXPECTED)) console.log(`  ${code}: ${message} ${pointer ?? ""}`);
    for (const code of new Set([...Object.keys(codes), ...Object.keys(EXPECTED)]))
        wrong ||= codes[code] !== EXPECTED[code];
}
if (wrong) console.log(`FAILED: expected ${JSON.stringify(EXPECTED)} of each file`);
process.exitCode = wrong ? 1 : 0;
