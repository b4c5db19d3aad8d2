// The test explorer, with an editor that only notes what it is told, and with plcc itself if PLCC names it.

const test = require('node:test');
const assert = require('node:assert');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const { testsIn, resultsOf, describe, register } = require('../tests');

test('tests are found with their lines', () => {
  const text = 'program "a.pmi"\r\ntest "one"\r\nend\r\n  # test "no"\n\ttest "two" # it\nend\n';
  assert.deepStrictEqual(testsIn(text), [{ name: 'one', line: 1 }, { name: 'two', line: 4 }]);
});

test('results are read by the names of tests', () => {
  const failure = { line: 3, message: 'LAMP is 0', values: { LAMP: 0 }, events: [], why: 'LAMP is 0 because DOOR is 0' };
  const lines = [
    { script: 'a', test: 'one', line: 1, result: 'passed', ticks: 4 },
    { script: 'a', test: 'two', line: 2, result: 'failed', ticks: 4, failure },
    { tests: 2, failed: 1 },
  ];
  const results = resultsOf(lines.map((line) => JSON.stringify(line)).join('\n'));
  assert.deepStrictEqual([...results.keys()], ['one', 'two']);
  assert.strictEqual(describe(results.get('two').failure), 'LAMP is 0\nLAMP = 0\nLAMP is 0 because DOOR is 0');
});

/** As much of VS Code as the explorer needs, with the scripts of a folder. */
function editor(folder) {
  const told = [];
  const noted = (what) => (item, message) => told.push([what, item.label, ...(message ? [message.text, message.location.position.line] : [])]);
  const item = (id, label, uri) => {
    const children = new Map();
    const it = { id, label, uri, children };
    children.add = (child) => { child.parent = it; children.set(child.id, child); };
    return it;
  };
  const items = new Map();
  items.add = (it) => items.set(it.id, it);
  let profile;
  const written = [];
  let runTest;
  const token = { isCancellationRequested: false, onCancellationRequested() {} };
  const uri = (name) => ({ fsPath: path.join(folder, name), toString: () => `file://${path.join(folder, name)}` });
  const vscode = {
    tests: {
      createTestController: () => ({
        items,
        createTestItem: item,
        createRunProfile: (_, __, handler) => { profile = handler; },
        createTestRun: () => ({ appendOutput: (text) => written.push(text), started: () => {}, passed: noted('passed'), failed: noted('failed'), errored: noted('errored'), end: () => told.push(['end']) }),
      }),
    },
    workspace: {
      createFileSystemWatcher: () => ({ onDidCreate() {}, onDidChange() {}, onDidDelete() {} }),
      findFiles: async () => fs.readdirSync(folder).filter((name) => name.endsWith('.plctest')).map(uri),
      fs: { readFile: async (it) => fs.readFileSync(it.fsPath) },
      asRelativePath: (it) => path.basename(it.fsPath),
      getWorkspaceFolder: () => undefined,
    },
    Range: class {},
    Position: class { constructor(line) { this.line = line; } },
    Location: class { constructor(place, position) { this.position = position; } },
    TestMessage: class { constructor(text) { this.text = text; this.location = { position: {} }; } },
    TestRunProfileKind: { Run: 1 },
    TestRunRequest: class { constructor(include) { this.include = include; } },
    CancellationTokenSource: class { constructor() { this.token = token; } },
    Uri: { parse: (address) => uri(path.basename(address)) },
    commands: { registerCommand: (_, run) => { runTest = run; } },
    Disposable: { from: () => {} },
  };
  return { vscode, items, told, written, run: (request) => profile(request, token), runTest: (...of) => runTest(...of) };
}

test('tests are run and their results are shown', { skip: !process.env.PLCC && 'PLCC does not name plcc' }, async () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'plcc-tests-'));
  try {
    fs.writeFileSync(path.join(folder, 'a.pmi'), '$INPUT\nDOOR = 1/0\n$OUTPUT\nLAMP = 2/0\n$END\nLAMP = DOOR\n');
    fs.writeFileSync(path.join(folder, 'a.plctest'),
      'program "a.pmi"\ntest "on"\n  set DOOR = 1\n  run 2 ticks\n  expect LAMP\nend\ntest "off"\n  expect LAMP\nend\n');
    const it = editor(folder);
    register(it.vscode, () => process.env.PLCC);
    await new Promise((resolve) => { setTimeout(resolve, 100); });
    const [script] = it.items.values();
    assert.deepStrictEqual([...script.children.keys()], ['on', 'off']);
    await it.run({});
    assert.deepStrictEqual(it.told.map((one) => one.slice(0, 2)), [['passed', 'on'], ['failed', 'off'], ['end']]);
    assert.match(it.told[1][2], /LAMP/);
    assert.strictEqual(it.told[1][3], 7);
    assert.deepStrictEqual([it.written[0], it.written[1].split('\r\n')[0]], ['on: passed, 2 ticks\r\n', 'off: failed']);
    it.told.length = 0;
    await it.run({ include: [script.children.get('on')] });
    assert.deepStrictEqual(it.told, [['passed', 'on'], ['end']]);
    it.told.length = 0;
    await it.runTest(`file://${folder}/a.plctest`, 'on');
    assert.deepStrictEqual(it.told, [['passed', 'on'], ['end']]);
    fs.writeFileSync(path.join(folder, 'a.plctest'), 'program "a.pmi"\ntest "on"\n  sett DOOR = 1\nend\n');
    it.told.length = 0;
    await it.run({ include: [script.children.get('on')] });
    assert.strictEqual(it.told[0][0], 'errored');
    assert.match(it.told[0][2], /TEST-1/);
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
});
