// Usage: node parquet_clients.mjs read TABLES STORE | write STORE OUT
//
// read: hyparquet and parquet-wasm read the tables of the split train as the store, an import of them, has the rows.
// write: parquet-wasm writes the rows of a store as tables of the published schema, in falling order.
import fs from "node:fs";
import path from "node:path";
import { createRequire } from "node:module";

const require = createRequire(path.join(process.cwd(), "client.js"));
const arrow = require("apache-arrow");
const wasm = require("parquet-wasm/node");

const TABLES = {
    intrins: ["intrinsics"], poses: ["pose"], rgbs: ["rgb", "rgb"], depths: ["depth", "depth"],
    normals: ["normal", "normal"], segmentation: ["segmentation", "mask"],
};

/** The numbers of a .npy file behind its header, by row. */
function npyRows(file, rows) {
    const bytes = fs.readFileSync(file);
    const data = bytes.subarray(10 + bytes.readUInt16LE(8));
    const size = data.length / rows;
    return Array.from({ length: rows }, (_, i) => data.subarray(i * size, (i + 1) * size));
}

/** Rows of each table as the store has them: uuid, frame, value. */
function rowsOf(store) {
    const index = JSON.parse(fs.readFileSync(path.join(store, "store.json"), "utf8"));
    const frames = npyRows(path.join(store, "frame.npy"), index.rows).map((b) => Number(b.readBigInt64LE(0)));
    const poses = npyRows(path.join(store, "pose.npy"), index.rows).map((b) => b.toString("latin1").replace(/\0+$/, ""));
    const uuids = index.objects.flatMap((o) => Array(o.views).fill(o.name));
    const rows = { intrins: index.objects.map((o) => [o.name, null, o.intrinsics]) };
    rows.poses = poses.map((pose, i) => [uuids[i], frames[i], pose]);
    for (const [table, [, map]] of Object.entries(TABLES)) {
        if (!index.maps.includes(map)) continue;
        rows[table] = npyRows(path.join(store, `${map}.npy`), index.rows).map((image, i) => [uuids[i], frames[i], image]);
    }
    return rows;
}

function fail(sentence) {
    console.error(sentence);
    process.exit(1);
}

/** Compare rows {uuid, frame_id, <column>} with those of the store. */
function compare(client, table, found, expected) {
    const column = TABLES[table][0];
    if (found.length !== expected.length) fail(`${client}: ${table} has ${found.length} rows, expected ${expected.length}`);
    found.forEach((row, i) => {
        const [uuid, frame, value] = expected[i];
        const id = table === "normals" ? String(frame).padStart(6, "0") : frame;
        if (row.uuid !== uuid) fail(`${client}: ${table}, row ${i}: uuid ${row.uuid}, expected ${uuid}`);
        if (frame !== null && row.frame_id !== (typeof id === "string" ? id : BigInt(id)))
            fail(`${client}: ${table}, row ${i}: frame_id ${row.frame_id}, expected ${id}`);
        const same = typeof value === "string" ? row[column] === value : Buffer.compare(Buffer.from(row[column]), value) === 0;
        if (!same) fail(`${client}: ${table}, row ${i}: another ${column}`);
    });
}

async function read(tables, store) {
    const { asyncBufferFromFile, parquetReadObjects } = await import(require.resolve("hyparquet"));
    for (const [table, expected] of Object.entries(rowsOf(store))) {
        const file = path.join(tables, table, "train", `${table}.parquet`);
        const options = { file: await asyncBufferFromFile(file), utf8: false };
        compare("hyparquet", table, await parquetReadObjects(options), expected);
        const ipc = wasm.readParquet(fs.readFileSync(file)).intoIPCStream();
        compare("parquet-wasm", table, arrow.tableFromIPC(ipc).toArray().map((row) => row.toJSON()), expected);
        console.log(`hyparquet and parquet-wasm read ${expected.length} rows of ${table}`);
    }
}

function write(store, out) {
    const properties = new wasm.WriterPropertiesBuilder().setCompression(wasm.Compression.SNAPPY).build();
    for (const [table, rows] of Object.entries(rowsOf(store))) {
        rows.reverse();
        const text = (values) => arrow.vectorFromArray(values, new arrow.Utf8());
        const columns = { uuid: text(rows.map((row) => row[0])) };
        if (table === "normals") columns.frame_id = text(rows.map((row) => String(row[1]).padStart(6, "0")));
        else if (table !== "intrins")
            columns.frame_id = arrow.vectorFromArray(rows.map((row) => BigInt(row[1])), new arrow.Int64());
        const values = rows.map((row) => row[2]);
        columns[TABLES[table][0]] = typeof values[0] === "string" ? text(values) : arrow.vectorFromArray(values, new arrow.Binary());
        const ipc = arrow.tableToIPC(new arrow.Table(columns), "stream");
        const folder = path.join(out, table, "train");
        fs.mkdirSync(folder, { recursive: true });
        fs.writeFileSync(path.join(folder, `${table}.parquet`), wasm.writeParquet(wasm.Table.fromIPCStream(ipc), properties));
    }
}

const [mode, from, to] = process.argv.slice(2);
if (mode === "read") await read(from, to);
else write(from, to);
