using System;
using System.Collections;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Text;

/// <summary>
/// Roslyn's csc, of which npm has the libraries and not the program; arguments are those of csc. mcs compiles it, which
/// cannot read those libraries, so it calls them by reflection.
/// </summary>
internal static class Compile
{
    private static Assembly common;
    private static Assembly csharp;
    private static object given;

    private static int Main(string[] arguments)
    {
        common = Load("Microsoft.CodeAnalysis");
        csharp = Load("Microsoft.CodeAnalysis.CSharp");
        object parser = Class(csharp, "CSharp.CSharpCommandLineParser").GetProperty("Default").GetValue(null);
        given = Call(parser.GetType(), parser, m => m.ReturnType.Name == "CSharpCommandLineArguments", "Parse",
                     arguments, Directory.GetCurrentDirectory(), null);
        object sources = All("SourceFiles", Class(common, "SyntaxTree"), file => Parsed((string)Of(file, "Path")));
        Type reference = Class(common, "MetadataReference");
        object references = All("MetadataReferences", reference, file =>
            Call(reference, null, m => true, "CreateFromFile", Of(file, "Reference")));
        string name = (string)Of(given, "OutputFileName");
        object whole = Call(Class(csharp, "CSharp.CSharpCompilation"), null, m => true, "Create",
            Path.GetFileNameWithoutExtension(name), sources, references, Of(given, "CompilationOptions"));
        object result = Call(Class(common, "FileSystemExtensions"), null, m => true, "Emit",
            whole, Path.Combine((string)Of(given, "OutputDirectory"), name), null, Of(given, "DocumentationPath"), null,
            Of(given, "ManifestResources"));
        foreach (object each in Items(Of(given, "Errors")).Concat(Items(Of(result, "Diagnostics"))))
            if (Of(each, "Severity").ToString() != "Hidden") Console.Error.WriteLine(each);
        return (bool)Of(result, "Success") ? 0 : 1;
    }

    private static object Parsed(string path)
    {
        Type tree = Class(csharp, "CSharp.CSharpSyntaxTree");
        return Call(tree, null,
                    m => m.GetParameters()[0].ParameterType == typeof(string) && m.GetParameters().Length == 5,
                    "ParseText", File.ReadAllText(path), Of(given, "ParseOptions"), path, Encoding.UTF8);
    }

    private static Assembly Load(string name) =>
        Assembly.LoadFrom(Path.Combine(AppDomain.CurrentDomain.BaseDirectory, name + ".dll"));

    private static Type Class(Assembly from, string name) => from.GetType("Microsoft.CodeAnalysis." + name, true);

    private static object Of(object item, string property) =>
        item.GetType().GetProperties().First(p => p.Name == property).GetValue(item);

    private static object[] Items(object list) => ((IEnumerable)list).Cast<object>().ToArray();

    /// <summary>A list of the arguments as an array of what is made of each.</summary>
    private static object All(string list, Type type, Func<object, object> make)
    {
        object[] made = Items(Of(given, list)).Select(make).ToArray();
        Array array = Array.CreateInstance(type, made.Length);
        Array.Copy(made, array, made.Length);
        return array;
    }

    /// <summary>Call the first method of that name that fits, with defaults for what is not given.</summary>
    private static object Call(Type type, object on, Func<MethodInfo, bool> fits, string name, params object[] first)
    {
        MethodInfo method = type.GetMethods().First(
            m => m.Name == name && m.GetParameters().Length >= first.Length && fits(m));
        object[] all = method.GetParameters().Select((p, i) => i < first.Length ? first[i]
            : p.ParameterType.IsValueType ? Activator.CreateInstance(p.ParameterType) : null).ToArray();
        return method.Invoke(on, BindingFlags.Default, null, all, CultureInfo.InvariantCulture);
    }
}
