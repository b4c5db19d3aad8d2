// Connects VS Code with `plcc debug`, and adds the ways to move that the Debug Adapter Protocol has no
// request for.

const vscode = require('vscode');

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

function activate(context) {
  const add = (disposable) => context.subscriptions.push(disposable);
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
