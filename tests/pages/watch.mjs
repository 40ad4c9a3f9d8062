// Opens a served page in Chromium; prints its text whenever a line arrives on standard input.
import { createInterface } from "node:readline";
import puppeteer from "puppeteer-core";

const [executablePath, address] = process.argv.slice(2);
const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox"] });
const page = await browser.newPage();
const messages = [];
page.on("console", (message) => messages.push(message.text()));
page.on("pageerror", (error) => messages.push(String(error)));
await page.goto(address);
for await (const wanted of createInterface({ input: process.stdin })) {
  const waited = page.waitForFunction(
    (text) => document.querySelector("iframe").contentDocument?.body?.innerText.includes(text),
    { timeout: 60000 },
    wanted,
  );
  const found = await waited.then(() => true, () => false);
  console.log(JSON.stringify({ wanted, found, messages }));
}
await browser.close();
