// Values beside names, with an editor and a server that only note what they are told.

const test = require('node:test');
const assert = require('node:assert');
const { register } = require('../values');

/** An editor with answers to what it asks its user, and a server whose run has these ticks. */
function editor(first, last, answers) {
  const it = { asked: [], questions: [], errors: [], commands: new Map(), bar: {} };
  const answer = async (options) => answers.shift();
  it.vscode = {
    StatusBarAlignment: { Left: 1 },
    window: {
      activeTextEditor: {
        document: { uri: { toString: () => 'file:///a.pmi' }, getWordRangeAtPosition: () => 1, getText: () => 'LAMP' },
        selection: { active: 0 },
      },
      createStatusBarItem: () => Object.assign(it.bar, { show() {}, hide() { it.bar.text = undefined; } }),
      showOpenDialog: async () => [{ fsPath: '/run/cell' }],
      showInputBox: answer,
      showWarningMessage: async (text, options) => { it.questions.push(text); return options && answer(); },
      showErrorMessage: (text) => { it.errors.push(text); },
    },
    commands: {
      registerCommand: (name, run) => { it.commands.set(name, run); return { dispose() {} }; },
      executeCommand: async () => {},
    },
    Disposable: { from: (...all) => ({ dispose: () => all.forEach((one) => one.dispose && one.dispose()) }) },
  };
  const disposable = register(it.vscode, async (method, params) => {
    it.asked.push([method, params.tick !== undefined ? params.tick : params.name]);
    if (method === 'plcc/showValues') {
      return { tick: params.tick === null ? last : params.tick, first, last };
    }
    if (params.name === 'BAD') {
      throw new Error('there is no BAD');
    }
    return {};
  });
  it.run = (name) => it.commands.get(`plcc.${name}`)();
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
