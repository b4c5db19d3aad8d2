// Tasks and the monitor, with an editor that only notes what it is told.

const test = require('node:test');
const assert = require('node:assert');
const path = require('node:path');
const tasks = require('../tasks');
const monitor = require('../monitor');

/** An editor with a program open in the folder /work, its settings, the files that are there, and what its user chooses. */
function editor(name, languageId, settings = {}, files = [], chosen = 0) {
  const it = { terminals: [], offered: [] };
  const folder = { uri: { fsPath: '/work' } };
  it.vscode = {
    window: {
      activeTextEditor: { document: { uri: { fsPath: path.join('/work', name) }, languageId } },
      showQuickPick: async (choices) => { it.offered = choices.map((one) => one.label); return choices[chosen]; },
      showOpenDialog: async () => [{ fsPath: '/run/cell' }],
      createTerminal: (options) => { it.terminals.push(options); return { show() {} }; },
    },
    workspace: {
      workspaceFolders: [folder],
      getConfiguration: () => ({ get: (key) => settings[key] }),
      getWorkspaceFolder: () => folder,
      asRelativePath: () => name,
      fs: { stat: async ({ fsPath }) => { if (!files.includes(fsPath)) throw new Error('none'); } },
    },
    Uri: { file: (fsPath) => ({ fsPath }) },
    tasks: { registerTaskProvider: (_, provider) => { it.provider = provider; } },
    commands: { registerCommand: (_, run) => { it.monitor = run; } },
    TaskScope: { Workspace: 2 },
    TaskGroup: { Build: 'build', Test: 'test' },
    TerminalLocation: { Editor: 2 },
    ProcessExecution: class { constructor(plcc, args, options) { Object.assign(this, { plcc, args, options }); } },
    Task: class { constructor(definition, scope, label, source, execution) { Object.assign(this, { definition, label, execution }); } },
  };
  tasks.register(it.vscode, () => 'plcc');
  monitor.register(it.vscode, () => 'plcc');
  return it;
}

test('tasks check the program with its settings and run the test scripts', () => {
  const it = editor('mill.pmc', 'pmac', { turbo: true, noLimits: true, include: ['lib'] });
  const made = it.provider.provideTasks();
  assert.deepStrictEqual(made.map((one) => [one.label, one.group]), [['test all scripts', 'test'], ['check mill.pmc', 'build']]);
  const options = ['--limits', 'none', '-I', 'lib', '--controller', 'turbo'];
  assert.deepStrictEqual(made[1].execution.args, ['check', '--dialect', 'pmac', ...options, '/work/mill.pmc']);
  assert.deepStrictEqual(made[1].execution.options, { cwd: '/work' });
  const own = it.provider.resolveTask({ definition: { type: 'plcc', args: ['check', 'a.pmi'] }, scope: { uri: { fsPath: '/x' } }, name: 'a' });
  assert.deepStrictEqual([own.execution.args, own.execution.options.cwd], [['check', 'a.pmi'], '/x']);
  assert.strictEqual(it.provider.resolveTask({ definition: { type: 'plcc' } }), undefined);
});

test('the monitor runs a program with its stimulus, or shows a run', async () => {
  const programs = { programs: [['io.pmc', 'mill.pmc']] };
  const it = editor('mill.pmc', 'pmac', programs, ['/work/mill.csv']);
  await it.monitor();
  assert.deepStrictEqual(it.terminals[0].shellArgs, ['monitor', '/work/io.pmc', '/work/mill.pmc', '--stimulus', '/work/mill.csv']);
  assert.strictEqual(it.offered.length, 4);
  const other = editor('notes.txt', 'plaintext');
  await other.monitor();
  assert.deepStrictEqual([other.offered, other.terminals[0].shellArgs], [[], ['monitor', '/run/cell']]);
});
