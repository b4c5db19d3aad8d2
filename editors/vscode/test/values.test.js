// Values beside names, with an editor and a server that only note what they are told.

const test = require('node:test');
const assert = require('node:assert');
const { register } = require('../values');

/** An editor with answers to what it asks its user, and a server whose run has these ticks. */
function editor(first, last, answers) {
  const it = { asked: [], questions: [], errors: [], lines: [], slid: [], contexts: {}, commands: new Map(), bar: {} };
  const answer = async (options) => answers.shift();
  it.vscode = {
    StatusBarAlignment: { Left: 1 },
    window: {
      activeTextEditor: {
        document: { uri: { toString: () => 'file:///a.pmi' }, getWordRangeAtPosition: () => 1, getText: () => 'LAMP' },
        selection: { active: 0 },
      },
      createStatusBarItem: () => Object.assign(it.bar, { show() {}, hide() { it.bar.text = undefined; } }),
      createOutputChannel: () => ({ appendLine: (line) => { it.lines.push(line); }, show() {}, dispose() {} }),
      registerWebviewViewProvider: (id, provider) => {
        const webview = {
          postMessage: (message) => { it.slid.push(message); },
          onDidReceiveMessage: (receive) => { it.slide = receive; },
        };
        provider.resolveWebviewView({ webview, onDidDispose() {} });
        assert.match(webview.html, /type="range"/);
        return { dispose() {} };
      },
      showOpenDialog: async () => [{ fsPath: '/run/cell' }],
      showInputBox: answer,
      showWarningMessage: async (text, options) => { it.questions.push(text); return options && answer(); },
      showErrorMessage: (text) => { it.errors.push(text); },
    },
    commands: {
      registerCommand: (name, run) => { it.commands.set(name, run); return { dispose() {} }; },
      executeCommand: async (command, key, value) => { it.contexts[key] = value; },
    },
    Disposable: { from: (...all) => ({ dispose: () => all.forEach((one) => one.dispose && one.dispose()) }) },
  };
  const disposable = register(it.vscode, async (method, params) => {
    it.asked.push([method, params.tick !== undefined ? params.tick : params.name]);
    if (method === 'plcc/showValues') {
      return { tick: params.tick === null ? last : params.tick, first, last };
    }
    if (method === 'plcc/why') {
      return { text: `${params.name} is 1\n` };
    }
    if (params.name === 'BAD') {
      throw new Error('there is no BAD');
    }
    return {};
  });
  it.run = (name, ...words) => it.commands.get(`plcc.${name}`)(...words);
  it.end = () => disposable.dispose();
  return it;
}

test('a record is gone through', async () => {
  const it = editor(5, 900, ['7']);
  await it.run('showValues');
  assert.match(it.bar.text, /PAST: tick 900 of 5 to 900/);
  await it.run('valuesForward');
  await it.run('valuesBack');
  await it.run('valuesGoTo');
  assert.deepStrictEqual(it.asked.map(([, tick]) => tick), [null, 900, 899, 7]);
  assert.deepStrictEqual(it.contexts, { 'plcc.showsValues': true, 'plcc.showsRecord': true });
  // The slider shows the tick, and of ticks that come fast the first and the last one are shown.
  assert.deepStrictEqual(it.slid.at(-1), { tick: 7, first: 5, last: 900 });
  await it.slide({ ready: true });
  await Promise.all([20, 21, 22, 23].map((tick) => it.slide({ tick })));
  assert.deepStrictEqual(it.asked.slice(4).map(([, tick]) => tick), [20, 23]);
  assert.deepStrictEqual(it.slid.at(-1), { tick: 23, first: 5, last: 900 });
  // A lens names the variable; by hand it is the one at the cursor.
  await it.run('why', 'DOOR');
  assert.deepStrictEqual(it.lines, ['DOOR is 1\n']);
  await it.run('forceVariable');
  assert.match(it.questions[0], /running control first/);
  await it.run('hideValues');
  assert.strictEqual(it.bar.text, undefined);
  it.end();
});

test('a running control is changed after a question only', async () => {
  const it = editor(40, 40, ['LAMP', '1', 'Force LAMP = 1', 'LAMP', '0', undefined, 'BAD', 'Unforce BAD']);
  await it.run('showValues');
  assert.match(it.bar.text, /tick 40$/);
  await it.run('forceVariable');
  await it.run('setVariable');
  await it.run('unforceVariable');
  assert.deepStrictEqual(it.questions, ['Force LAMP = 1?', 'Set LAMP = 0?', 'Unforce BAD?']);
  assert.deepStrictEqual(it.asked.filter(([method]) => method === 'plcc/change').map(([, name]) => name), ['LAMP', 'BAD']);
  assert.deepStrictEqual(it.errors, ['there is no BAD']);
  it.end();
});
