/** Reference page of the HTTP API at `/v1/docs`, drawn from the server's OpenAPI description without other sites. */
import { type Content, groupRoutes, type OpenApi, type Route, type Schema } from "./openapi";
import { limitText, schemaText } from "./schema-text";

const DESCRIPTION_URL = "/v1/openapi.json";

type Child = Node | string;

function create(tag: string, attributes: Record<string, string> = {}, ...children: Child[]): HTMLElement {
  const created = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) created.setAttribute(name, value);
  created.append(...children);
  return created;
}

/** Return text with the parts between backquotes as code. */
function prose(text: string): Child[] {
  return text.split("`").map((part, index) => (index % 2 ? create("code", {}, part) : part));
}

function paragraphs(text: string | undefined): HTMLElement[] {
  return (text ?? "").split(/\n{2,}/).flatMap((one) => (one ? [create("p", {}, ...prose(one))] : []));
}

function routeId({ method, path }: Route): string {
  return `${method}-${path}`.replace(/[^A-Za-z0-9]+/g, "-").toLowerCase();
}

function contentBlocks(title: string, content: Content | undefined, schemas: Record<string, Schema>): HTMLElement[] {
  return Object.entries(content ?? {}).flatMap(([mediaType, { schema }]) => {
    // Responses that FastAPI cannot describe have an empty schema.
    const text = schemaText(schema, schemas);
    const heading = create("h4", {}, `${title}: `, create("code", {}, mediaType));
    return text === "any" ? [heading] : [heading, create("pre", { tabindex: "0" }, create("code", {}, text))];
  });
}

function parameterTable(route: Route, schemas: Record<string, Schema>): HTMLElement[] {
  const rows = (route.operation.parameters ?? []).map((parameter) =>
    create(
      "tr",
      {},
      create("th", { scope: "row" }, create("code", {}, parameter.name), parameter.required ? "" : " (optional)"),
      create("td", {}, parameter.in),
      create("td", {}, create("code", {}, schemaText(parameter.schema, schemas))),
      create("td", {}, ...prose([parameter.description, limitText(parameter.schema ?? {})].filter(Boolean).join("; "))),
    ),
  );
  return rows.length ? [create("h4", {}, "Parameters"), create("table", {}, create("tbody", {}, ...rows))] : [];
}

function routeSection(route: Route, schemas: Record<string, Schema>): HTMLElement {
  const { operation } = route;
  const role = operation["x-role"];
  return create(
    "section",
    { id: routeId(route) },
    create("h3", {}, create("span", { class: "method" }, route.method), " ", create("code", {}, route.path)),
    create("p", { class: "role" }, role === undefined ? "Public" : `Role ${role}`),
    ...paragraphs(operation.description ?? operation.summary),
    ...parameterTable(route, schemas),
    ...contentBlocks("Body", operation.requestBody?.content, schemas),
    ...Object.entries(operation.responses ?? {}).flatMap(([status, response]) => [
      create("h4", {}, `${status} ${response.description ?? ""}`),
      ...contentBlocks("Response", response.content, schemas),
    ]),
  );
}

function draw(description: OpenApi): void {
  const main = document.querySelector("main");
  const navigation = document.querySelector("nav");
  const schemas = description.components?.schemas ?? {};
  document.querySelector("h1")?.append(` ${description.info.version}`);
  main?.replaceChildren();
  for (const [tag, routes] of groupRoutes(description)) {
    const links = routes.map((route) =>
      create("li", {}, create("a", { href: `#${routeId(route)}` }, `${route.method} ${route.path}`)),
    );
    navigation?.append(create("h2", {}, tag), create("ul", {}, ...links));
    main?.append(create("h2", {}, tag), ...routes.map((route) => routeSection(route, schemas)));
  }
  // The target of the address did not exist when the page was loaded.
  if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
}

try {
  const response = await fetch(DESCRIPTION_URL);
  if (!response.ok) throw new Error(`the server answered ${response.status}`);
  draw((await response.json()) as OpenApi);
} catch (error) {
  document
    .querySelector("main")
    ?.replaceChildren(create("p", { role: "alert" }, `Cannot load ${DESCRIPTION_URL}: ${String(error)}`));
}
