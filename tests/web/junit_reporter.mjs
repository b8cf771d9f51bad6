// Node's events as JUnit, which only later versions of Node write by themselves.
const escaped = (text) => String(text).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

export default async function* report(events) {
  yield "<testsuite>\n";
  for await (const { type, data } of events) {
    if (type !== "test:pass" && type !== "test:fail") continue;
    const inner = type === "test:fail" ? `<failure message="${escaped(data.details.error?.message)}"/>` : data.skip ? `<skipped message="${escaped(data.skip)}"/>` : "";
    yield `<testcase name="${escaped(data.name)}" time="${data.details.duration_ms / 1000}">${inner}</testcase>\n`;
  }
  yield "</testsuite>\n";
}
