// Connects VS Code with `plcc debug` and `plcc lsp`, and adds the ways to move that the Debug Adapter Protocol has no
// request for.

const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const monitor = require('./monitor');
const tasks = require('./tasks');
const tests = require('./tests');
const values = require('./values');

/** The path of plcc from the setting `plcc.path`, in which `${workspaceFolder}` stands for the folder's path. */
function executable(folder) {
  const path = vscode.workspace.getConfiguration('plcc').get('path') || 'plcc';
  return folder ? path.replace(/\$\{workspaceFolder\}/g, folder.uri.fsPath) : path;
}

/** The variable on which the command was chosen; else asks for a name, with the word under the cursor as a proposal. */
async function askName(context, title) {
  if (context && context.variable) {
    return context.variable.evaluateName || context.variable.name;
  }
  const editor = vscode.window.activeTextEditor;
  const range = editor && editor.document.getWordRangeAtPosition(editor.selection.active);
  const value = range ? editor.document.getText(range) : '';
  return vscode.window.showInputBox({ title, prompt: 'The variable, as the program names it', value });
}

/** Sends one of the requests `plcc/…` to the debug session; if it fails, shows why. */
async function send(request, args) {
  const session = vscode.debug.activeDebugSession;
  if (!session || session.type !== 'plcc') {
    return;
  }
  try {
    await session.customRequest(request, args);
  } catch (error) {
    vscode.window.showWarningMessage(String(error.message || error));
  }
}

/** The client of `plcc lsp`, which starts it. */
function languageClient() {
  const folder = vscode.workspace.workspaceFolders && vscode.workspace.workspaceFolders[0];
  const settings = vscode.workspace.getConfiguration('plcc');
  const server = { command: executable(folder), args: ['lsp'] };
  return new LanguageClient('plcc', 'plcc', server, {
    documentSelector: [
      ...['pmi', 'nct', 'pmac', 'plctest'].map((language) => ({ language })),
      { scheme: 'file', pattern: '**/*.machine.toml' },
    ],
    initializationOptions: {
      programs: settings.get('programs'),
      turbo: settings.get('turbo'),
      noLimits: settings.get('noLimits'),
      include: settings.get('include'),
      explainLinks: true,
    },
    synchronize: {
      fileEvents: vscode.workspace.createFileSystemWatcher('**/*.{pmi,nct,pmc,pmac,plc,h,toml,plctest}'),
    },
  });
}

/** Starts the language server; without it colours and the debugger stay. */
async function startServer(context) {
  const client = languageClient();
  context.subscriptions.push({ dispose: () => client.stop() });
  try {
    await client.start();
  } catch (error) {
    const what = `plcc lsp can't be started (the setting plcc.path says where plcc is): ${error.message || error}`;
    vscode.window.showWarningMessage(what);
  }
  return client;
}

function activate(context) {
  let client = startServer(context);
  const add = (disposable) => context.subscriptions.push(disposable);
  add(tests.register(vscode, executable));
  add(tasks.register(vscode, executable));
  add(monitor.register(vscode, executable));
  add(values.register(vscode, async (method, params) => (await client).sendRequest(method, params)));
  add(vscode.debug.registerDebugAdapterDescriptorFactory('plcc', {
    createDebugAdapterDescriptor(session) {
      return new vscode.DebugAdapterExecutable(executable(session.workspaceFolder), ['debug']);
    },
  }));
  add(vscode.debug.registerDebugConfigurationProvider('plcc', {
    // Without a launch.json the program in the editor is debugged.
    resolveDebugConfiguration(_folder, config) {
      const editor = vscode.window.activeTextEditor;
      if (!config.type && !config.request && editor) {
        return {
          type: 'plcc',
          request: 'launch',
          name: 'Debug the program',
          program: editor.document.uri.fsPath,
          stopOnEntry: true,
        };
      }
      return config;
    },
  }));
  const command = (name, run) => add(vscode.commands.registerCommand(`plcc.${name}`, run));
  command('restartServer', async () => {
    await (await client).stop();
    client = startServer(context);
  });
  // A lens tells how often a name is used; a click shows where.
  const showReferences = async (address, position) => {
    const uri = vscode.Uri.parse(address);
    const at = (await client).protocol2CodeConverter.asPosition(position);
    const places = await vscode.commands.executeCommand('vscode.executeReferenceProvider', uri, at);
    await vscode.commands.executeCommand('editor.action.showReferences', uri, at, places);
  };
  command('showReferences', showReferences);
  // Of a line that declares many names there is one lens, which asks which of them is meant.
  const choose = async (title, names) => vscode.window.showQuickPick(
    names.map(({ name, uses, position }) => ({ label: name, description: uses, position })), { title });
  command('showReferencesOf', async (address, names) => {
    const chosen = await choose('Where is which name used?', names);
    if (chosen) {
      await showReferences(address, chosen.position);
    }
  });
  command('whyOf', async (names) => {
    const chosen = await choose('Why has which variable its value?', names);
    if (chosen) {
      await vscode.commands.executeCommand('plcc.why', chosen.label);
    }
  });
  // The page of a diagnostic, behind the link at its code.
  add(vscode.workspace.registerTextDocumentContentProvider('plcc-explain', {
    async provideTextDocumentContent(address) {
      const code = address.path.replace(/\.md$/, '');
      return (await client).sendRequest('plcc/explain', { code });
    },
  }));
  command('scanBack', () => send('plcc/scanBack', {}));
  command('scanForward', () => send('plcc/scanForward', {}));
  command('lastChange', async (variable) => {
    const name = await askName(variable, 'Go to the statement that changed a variable last');
    if (name) {
      await send('plcc/lastChange', { name });
    }
  });
  command('lastWriter', async (variable) => {
    const name = await askName(variable, 'Go to the statement that wrote a variable last');
    if (name) {
      await send('plcc/lastWriter', { name });
    }
  });
  command('goToTick', async () => {
    const text = await vscode.window.showInputBox({
      title: 'Go to the beginning of a tick',
      prompt: 'The number of the tick, from 0',
      validateInput: (value) => (/^\d+$/.test(value) ? undefined : 'A whole number is expected'),
    });
    if (text) {
      await send('plcc/goToTick', { tick: Number(text) });
    }
  });
}

module.exports = { activate, deactivate() {} };
