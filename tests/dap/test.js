// Drives `plcc debug` with the test client of VS Code's debug adapters, which shares no code with
// plcc. For each language: a breakpoint with a condition, steps back over whole scans, the statement
// that wrote a variable last. PLCC names the program; tests/dap/run sets it.

const assert = require('node:assert');
const path = require('node:path');
const { DebugClient } = require('@vscode/debugadapter-testsupport');

const root = path.resolve(__dirname, '../..');
const plcc = process.env.PLCC || path.join(root, 'target/debug/plcc');
const example = (name) => path.join(root, 'examples', name);

/** The line of the first statement of a file that contains a text. */
function lineOf(file, text) {
  const lines = require('node:fs').readFileSync(file, 'latin1').split(/\r?\n/);
  const at = lines.findIndex((line) => line.includes(text));
  assert.ok(at >= 0, `${text} is not in ${file}`);
  return at + 1;
}

describe('plcc debug', () => {
  let client;

  beforeEach(async () => {
    client = new DebugClient(plcc, 'debug', 'plcc', { cwd: root });
    await client.start();
  });

  afterEach(() => client.stop());

  /** Launches a program with breakpoints in one file, and waits for the first stop. */
  async function launch(args, file, breakpoints, filters = ['stop']) {
    const initialized = client.waitForEvent('initialized');
    await client.initializeRequest();
    await client.launchRequest(args);
    await initialized;
    const source = { path: file };
    const set = await client.setBreakpointsRequest({ source, breakpoints });
    for (const breakpoint of set.body.breakpoints) {
      assert.ok(breakpoint.verified, breakpoint.message);
    }
    await client.setExceptionBreakpointsRequest({ filters });
    const [stopped] = await Promise.all([
      client.waitForEvent('stopped'),
      client.configurationDoneRequest(),
    ]);
    return where(stopped);
  }

  /** Why and where the program stands. */
  async function where(stopped) {
    const { reason, threadId, text } = stopped.body;
    const frames = await client.stackTraceRequest({ threadId });
    const frame = frames.body.stackFrames[0];
    const position = await client.customRequest('plcc/position');
    return { reason, text, line: frame.line, tick: position.body.tick, file: frame.source.path };
  }

  /** Sends a request that moves, and gives where the program stands then. */
  async function go(command, args = {}) {
    const [stopped] = await Promise.all([
      client.waitForEvent('stopped'),
      client.customRequest(command, { threadId: 1, ...args }),
    ]);
    return where(stopped);
  }

  async function value(expression) {
    const answer = await client.evaluateRequest({ expression, context: 'watch' });
    return answer.body.result;
  }

  /** What the statement reads and writes. */
  async function accesses() {
    const scopes = (await client.scopesRequest({ frameId: 1 })).body.scopes;
    const variablesReference = scopes[0].variablesReference;
    const variables = (await client.variablesRequest({ variablesReference })).body.variables;
    return variables.map(({ name, value }) => `${name} ${value}`);
  }

  it('PMI: the lathe', async () => {
    const program = example('pmi/lathe.pmi');
    const line = lineOf(program, 'MCHON=(');
    const first = await launch(
      { program, stimulus: example('pmi/lathe.csv'), ticks: 400 },
      program,
      [{ line, condition: '@CP115&/@ESTOP' }],
    );
    assert.deepStrictEqual(first, { reason: 'breakpoint', text: undefined, line, tick: 14, file: program });
    assert.strictEqual(await value('MCHON'), '1');
    const beginning = (await go('plcc/scanBack')).line;
    const back = await go('plcc/scanBack');
    assert.deepStrictEqual([back.tick, back.line], [12, beginning]);
    const changed = await go('plcc/lastChange', { name: 'MCHON' });
    assert.deepStrictEqual([changed.tick, changed.line], [10, line]);
    assert.ok((await accesses()).includes('MCHON (written) 0 → 1'));
    const before = await go('stepBack');
    assert.deepStrictEqual([before.tick, before.line], [10, line - 1]);
    const written = await go('plcc/lastWriter', { name: 'MCHON' });
    assert.deepStrictEqual([written.tick, written.line], [9, line]);
  });

  it('NCT: the milling machine', async () => {
    const program = example('nct/sample.plc');
    const line = lineOf(program, '(V002AI002)');
    const first = await launch(
      { program, stimulus: example('nct/sample.csv'), ticks: 1400 },
      program,
      [{ line, condition: 'I002' }],
    );
    assert.deepStrictEqual([first.reason, first.tick, first.line], ['breakpoint', 5, line]);
    const back = await go('plcc/scanBack');
    assert.strictEqual(back.tick, 4);
    assert.strictEqual((await go('plcc/scanBack')).tick, 3);
    await go('plcc/goToTick', { tick: 9 });
    const written = await go('plcc/lastChange', { name: 'F0105' });
    assert.ok(written.tick >= 5 && written.tick < 9, `tick ${written.tick}`);
    assert.ok((await accesses()).some((access) => access.startsWith('F0105 (written)')));
  });

  it('NCT: stops where a message comes', async () => {
    const program = example('nct/sample.plc');
    const stopped = await launch(
      { program, stimulus: example('nct/sample.csv'), ticks: 1400 },
      program,
      [],
      ['message'],
    );
    assert.strictEqual(stopped.reason, 'exception');
    assert.match(stopped.text, /SPINDLE REVOLUTION ERROR/);
    assert.ok((await accesses()).includes('Y710 (written) 0 → 1'));
  });

  it('PMAC: the small milling machine', async () => {
    const program = example('pmac/mill.pmc');
    const line = lineOf(program, 'P44=KEY_START');
    const stimulus = example('pmac/mill/encoder/stimulus.csv');
    const first = await launch(
      { program, stimulus, ticks: 2000 },
      program,
      [{ line, condition: 'P30=5' }],
    );
    assert.deepStrictEqual([first.reason, first.line], ['breakpoint', line]);
    assert.strictEqual(await value('P30'), '5');
    const back = await go('plcc/scanBack');
    assert.ok(back.tick < first.tick);
    const further = await go('plcc/scanBack');
    assert.ok(further.tick < back.tick && further.line === back.line);
    await go('plcc/goToTick', { tick: first.tick });
    const changed = await go('plcc/lastChange', { name: 'P30' });
    assert.strictEqual(changed.line, lineOf(program, 'FAULT=FAULT_ENCODER'));
    assert.ok((await accesses()).includes('P30 (written) 0 → 5'));
  });

  it('PMAC: a recording, from its end back', async () => {
    const { execFileSync } = require('node:child_process');
    const fs = require('node:fs');
    const folder = fs.mkdtempSync(path.join(require('node:os').tmpdir(), 'plcc-dap-'));
    const program = example('pmac/mill.pmc');
    const recording = path.join(folder, 'mill.plcrec');
    const stimulus = example('pmac/mill/encoder/stimulus.csv');
    const options = ['--stimulus', stimulus, '--ticks', '400', '--record', recording];
    execFileSync(plcc, ['run', program, ...options], { stdio: 'ignore' });
    const initialized = client.waitForEvent('initialized');
    await client.initializeRequest();
    await client.attachRequest({ recording });
    await initialized;
    const [stopped] = await Promise.all([
      client.waitForEvent('stopped'),
      client.configurationDoneRequest(),
    ]);
    assert.strictEqual((await where(stopped)).tick, 399);
    const fault = await go('plcc/lastChange', { name: 'P30' });
    assert.strictEqual(fault.line, lineOf(program, 'FAULT=FAULT_ENCODER'));
    const moved = await go('plcc/lastChange', { name: 'L3' });
    assert.deepStrictEqual([moved.tick, moved.line], [140, lineOf(program, 'L3=L1')]);
    fs.rmSync(folder, { recursive: true });
  });

  it('stops at the entry where it is told to, and at nothing else', async () => {
    const program = example('pmi/lathe.pmi');
    const first = await launch({ program, ticks: 20, stopOnEntry: true }, program, []);
    assert.deepStrictEqual([first.reason, first.tick], ['entry', 0]);
    const end = await go('continue');
    assert.deepStrictEqual([end.reason, end.tick], ['pause', 19]);
    const beginning = await go('reverseContinue');
    assert.deepStrictEqual([beginning.tick, beginning.line], [0, first.line]);
  });
});
