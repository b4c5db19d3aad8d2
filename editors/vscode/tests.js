// Shows the tests of test scripts (*.plctest) in VS Code's test explorer, and runs them with `plcc test`.

const { execFile } = require('child_process');

/** The tests of a script: the name and the line, from 0, of each. */
function testsIn(text) {
  const found = [];
  text.split(/\r\n|\r|\n/).forEach((line, number) => {
    const test = /^\s*test\s+"([^"]*)"/.exec(line);
    if (test) {
      found.push({ name: test[1], line: number });
    }
  });
  return found;
}

/** What became of each test, by its name, from the lines that `plcc test --message-format json` writes. */
function resultsOf(output) {
  const results = new Map();
  for (const line of output.split('\n').filter((it) => it.startsWith('{'))) {
    const result = JSON.parse(line);
    if (result.test !== undefined) {
      results.set(result.test, result);
    }
  }
  return results;
}

/** What is shown of a test that has failed. */
function describe(failure) {
  const values = Object.entries(failure.values || {}).map(([name, value]) => `${name} = ${JSON.stringify(value)}`);
  const events = (failure.events || []).map((event) => `event: ${event}`);
  const record = failure.record ? [`record: ${failure.record}`] : [];
  return [failure.message, ...values, ...events, ...(failure.why ? [failure.why] : []), ...record].join('\n');
}

/** Runs `plcc test`, and gives what it wrote. */
function run(plcc, args, cancelled) {
  return new Promise((resolve) => {
    const child = execFile(plcc, ['test', '--message-format', 'json', ...args], { maxBuffer: 64 << 20 },
      (error, output, errors) => resolve({ error, output, errors }));
    cancelled.onCancellationRequested(() => child.kill('SIGTERM'));
  });
}

/** Adds the tests of all scripts to the explorer. `executable` gives the path of plcc for a folder. */
function register(vscode, executable) {
  const controller = vscode.tests.createTestController('plcc', 'plcc');
  const watcher = vscode.workspace.createFileSystemWatcher('**/*.plctest');

  const show = async (uri) => {
    let text;
    try {
      text = Buffer.from(await vscode.workspace.fs.readFile(uri)).toString('utf8');
    } catch {
      controller.items.delete(uri.toString());
      return;
    }
    const script = controller.createTestItem(uri.toString(), vscode.workspace.asRelativePath(uri), uri);
    for (const { name, line } of testsIn(text)) {
      const item = controller.createTestItem(name, name, uri);
      item.range = new vscode.Range(line, 0, line, 0);
      script.children.add(item);
    }
    controller.items.add(script);
  };
  const showAll = async () => Promise.all((await vscode.workspace.findFiles('**/*.plctest')).map(show));
  watcher.onDidCreate(show);
  watcher.onDidChange(show);
  watcher.onDidDelete((uri) => controller.items.delete(uri.toString()));
  controller.resolveHandler = showAll;
  controller.refreshHandler = showAll;

  /** Runs the tests of a script, or one of them. */
  const runItem = async (item, session, token) => {
    const script = item.parent || item;
    const tests = item.parent ? [item] : [...script.children].map(([, test]) => test);
    tests.forEach((test) => session.started(test));
    const filter = item.parent ? ['--filter', item.label] : [];
    const plcc = executable(vscode.workspace.getWorkspaceFolder(script.uri));
    const { error, output, errors } = await run(plcc, [...filter, script.uri.fsPath], token);
    const results = resultsOf(output);
    for (const test of tests) {
      const result = results.get(test.label);
      const what = result && (result.failure ? `failed\n${describe(result.failure)}` : `passed, ${result.ticks} ticks`);
      // A terminal shows it.
      session.appendOutput(`${test.label}: ${what || 'was not run'}\n`.replace(/\r?\n/g, '\r\n'), undefined, test);
      if (!result) {
        // The script or its program has mistakes, which are in standard output, or plcc can't be started.
        const why = [errors, output].map((it) => it.trim()).filter(Boolean).join('\n') || String(error);
        session.errored(test, new vscode.TestMessage(why));
      } else if (result.failure) {
        const message = new vscode.TestMessage(describe(result.failure));
        message.location = new vscode.Location(script.uri, new vscode.Position(result.failure.line - 1, 0));
        session.failed(test, message);
      } else {
        session.passed(test);
      }
    }
  };
  const runRequest = async (request, token) => {
    const session = controller.createTestRun(request);
    const wanted = request.include || [...controller.items].map(([, item]) => item);
    const excluded = new Set(request.exclude || []);
    for (const item of wanted.filter((it) => !excluded.has(it) && !token.isCancellationRequested)) {
      await runItem(item, session, token);
    }
    session.end();
  };
  controller.createRunProfile('Run', vscode.TestRunProfileKind.Run, runRequest, true);
  // The lens above a test.
  const runTest = vscode.commands.registerCommand('plcc.runTest', async (address, name) => {
    const uri = vscode.Uri.parse(address);
    await show(uri);
    const script = controller.items.get(uri.toString());
    const item = script && script.children.get(name);
    if (item) {
      await runRequest(new vscode.TestRunRequest([item]), new vscode.CancellationTokenSource().token);
    }
  });
  showAll();
  return vscode.Disposable.from(controller, watcher, runTest);
}

module.exports = { testsIn, resultsOf, describe, register };
