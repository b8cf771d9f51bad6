// The worker of the search. The generator looks for "iframe-worker" in the names of scripts, and would load that of
// another host.

// To the search, a dash before a word means that pages must not have the word. Here it is more likely that of an
// option, such as --levels, which is found without it. A message that is text is what was typed.
const without_dashes = (message) =>
  typeof message.data === "string" ? { ...message, data: message.data.replace(/(^|\s)-+/g, "$1") } : message;

if (location.protocol !== "file:") {
  window.Worker = class extends Worker {
    postMessage(message) {
      super.postMessage(without_dashes(message));
    }
  };
} else {
  // A browser starts no worker for a page that lies in a folder. This runs the worker's script in a hidden frame.
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.waiting = [];
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.title = "search";
      document.body.append(frame);
      const inside = frame.contentWindow;
      const script = (address) => new Promise((resolve, reject) => {
        const element = frame.contentDocument.createElement("script");
        element.src = address;
        element.onload = resolve;
        element.onerror = reject;
        frame.contentDocument.body.append(element);
      });
      // A frame's own postMessage() would send to the frame itself; a worker's sends to the page.
      inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      inside.importScripts = (...addresses) =>
        addresses.reduce((before, address) => before.then(() => script(new URL(address, url))), Promise.resolve());
      // A worker never answers before postMessage() has returned, which is when the page begins to listen.
      this.deliver = (data) => setTimeout(() => inside.dispatchEvent(new inside.MessageEvent("message", { data })));
      script(url).then(() => {
        this.waiting.forEach(this.deliver);
        this.waiting = null;
      });
    }

    postMessage(message) {
      const data = without_dashes(message);
      if (this.waiting) this.waiting.push(data);
      else this.deliver(data);
    }

    terminate() {}
  };
}
