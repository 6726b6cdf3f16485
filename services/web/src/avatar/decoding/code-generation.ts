/**
 * Replacement of the `Function` constructor for the transcoder of textures, whose bindings (Emscripten's embind)
 * generate code at run time. The page's content security policy forbids that, so the same functions are composed here
 * instead, as embind does when it is built with `DYNAMIC_EXECUTION=0`.
 */

/** Type of a value in embind's bindings, as far as it is used. */
interface WireType {
  toWireType(destructors: unknown[] | null, value: unknown): unknown;
  fromWireType(value: unknown): unknown;
  readValueFromPointer(pointer: number): unknown;
  readonly argPackAdvance: number;
}

type Callable = (...values: unknown[]) => unknown;

/**
 * Replace `Function` in the realm of `scope`. The source of this function is sent to the worker of the transcoder, so
 * that it must not refer to anything outside itself.
 */
export function replaceCodeGeneration(scope: { Function: unknown }): void {
  const original = scope.Function as FunctionConstructor;

  /** Compose the function in the parameters `names` and `body` of a call of `Function`. */
  function compose(...texts: string[]): Callable {
    const names = texts.slice(0, -1);
    const body = texts.at(-1) ?? "";
    return (...values) => {
      const named = (name: string) => values[names.indexOf(name)];
      const argTypes = names.filter((name) => /^argType\d+$/.test(name)).map(named) as WireType[];
      const returnType = named("retType") as WireType;
      if (body.includes("invoker(fn")) return composeInvoker(body, names, named, argTypes, returnType);
      if (body.includes("readValueFromPointer")) return composeMethodCaller(body, named, argTypes, returnType);
      throw new Error(`Code generation is not available: ${body.slice(0, 80)}`);
    };
  }

  /** Compose a function that calls a C++ function. */
  function composeInvoker(
    body: string,
    names: readonly string[],
    named: (name: string) => unknown,
    argTypes: readonly WireType[],
    returnType: WireType,
  ): Callable {
    const isMethod = body.includes("thisWired");
    const hasStack = body.includes("var destructors");
    const isVoid = !body.includes("return ret;");
    const fail = named("throwBindingError") as Callable;
    const invoke = named("invoker") as Callable;
    const runDestructors = named("runDestructors") as Callable;
    const classType = named("classParam") as WireType;
    const destructors = names.filter((name) => name.endsWith("_dtor"));
    return function (this: unknown, ...args) {
      if (args.length !== argTypes.length)
        fail(`function ${named("humanName")} called with ${args.length} arguments, expected ${argTypes.length}`);
      const stack = hasStack ? [] : null;
      const instance = isMethod ? [classType.toWireType(stack, this)] : [];
      const wired = argTypes.map((type, at) => type.toWireType(stack, args[at]));
      const result = invoke(named("fn"), ...instance, ...wired);
      if (stack) runDestructors(stack);
      for (const name of destructors) {
        const at = /^arg(\d+)/.exec(name)?.[1];
        (named(name) as Callable)(at === undefined ? instance[0] : wired[Number(at)]);
      }
      return isVoid ? undefined : returnType.fromWireType(result);
    };
  }

  /** Compose a function that calls one of JavaScript for C++. */
  function composeMethodCaller(
    body: string,
    named: (name: string) => unknown,
    argTypes: readonly WireType[],
    returnType: WireType,
  ): Callable {
    const returnValue = named("emval_returnValue") as Callable | undefined;
    return (object, target, destructors, pointer) => {
      let at = Number(pointer);
      const args = argTypes.map((type) => {
        const value = type.readValueFromPointer(at);
        at += type.argPackAdvance;
        return value;
      });
      const call = target as Callable;
      const result = body.includes("new func")
        ? Reflect.construct(call, args)
        : body.includes("func.call(obj")
          ? call.apply(object, args)
          : call.apply(args[0], args.slice(1));
      return returnValue?.(returnType, destructors, result);
    };
  }

  // Functions stay instances of the replacement.
  compose.prototype = original.prototype;
  scope.Function = compose;
}
