// Render formulas with KaTeX in strict mode. Standard input: a JSON list of [formula, display].
// Standard output: a JSON list of [index, message] of those that are refused.
const katex = require(require.resolve("katex", { paths: [process.cwd()] }));
const chunks = [];
process.stdin.on("data", (chunk) => chunks.push(chunk));
process.stdin.on("end", () => {
    const refused = [];
    JSON.parse(Buffer.concat(chunks).toString("utf8")).forEach(([formula, displayMode], index) => {
        try {
            katex.renderToString(formula, { displayMode, strict: "error", throwOnError: true });
        } catch (error) {
            refused.push([index, String(error.message)]);
        }
    });
    process.stdout.write(JSON.stringify(refused));
});
