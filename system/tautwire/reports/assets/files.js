// Files that a page gives to its reader.

function slug(text) {
  return text.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
}

/** The text of a CSV file: float32 holds eight significant digits at most; what is absent is empty. */
function csvText(columns) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const cell = (value) => {
    if (typeof value === "string") return quoted(value);
    return value === null || value === undefined ? "" : String(Number(value.toPrecision(8)));
  };
  const count = Math.max(...columns.map(([, values]) => values.length));
  const rows = Array.from({ length: count }, (_, row) => columns.map(([, values]) => cell(values[row])).join(","));
  return [columns.map(([header]) => quoted(header)).join(","), ...rows, ""].join("\n");
}

function download(content, filename) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = filename;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
