using System;
using System.Collections;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Reflection;

namespace Splat
{
    /// <summary>
    /// Facts that never change. Two of them are equal if all their properties are, lists by their
    /// elements.
    /// </summary>
#if NET8_0_OR_GREATER
    [System.Diagnostics.CodeAnalysis.UnconditionalSuppressMessage("Trimming", "IL2090", Justification = Library.Whole)]
#endif
    public abstract class Facts<T> : IEquatable<T> where T : Facts<T>
    {
        private static readonly PropertyInfo[] Properties = typeof(T).GetProperties();

        // Other assemblies cannot derive from this class.
        internal Facts()
        {
        }

        // The values of all properties; a list counts as its length and its elements.
        private IEnumerable<object?> Parts()
        {
            foreach (PropertyInfo property in Properties)
            {
                object? value = property.GetValue(this);
                object[]? list = Elements(value);
                yield return list == null ? value : list.Length;
                foreach (object element in list ?? Array.Empty<object>()) yield return element;
            }
        }

        private static object[]? Elements(object? value) =>
            value is string ? null : (value as IEnumerable)?.Cast<object>().ToArray();

        /// <summary>Whether all facts are equal; NaN equals NaN.</summary>
        public virtual bool Equals(T? other) => !ReferenceEquals(other, null) && Parts().SequenceEqual(other.Parts());

        /// <inheritdoc/>
        public override bool Equals(object? other) => Equals(other as T);

        /// <inheritdoc/>
        public override int GetHashCode() =>
            Parts().Aggregate(17, (hash, part) => unchecked(31 * hash + (part?.GetHashCode() ?? 0)));

        /// <summary>Whether all facts are equal.</summary>
        public static bool operator ==(Facts<T>? left, Facts<T>? right) => Equals(left, right);

        /// <summary>Whether some facts differ.</summary>
        public static bool operator !=(Facts<T>? left, Facts<T>? right) => !Equals(left, right);

        /// <summary>"Kind { Name = value, ... }" of all facts, of a list the first 16.</summary>
        public override string ToString() =>
            typeof(T).Name + " { " +
            string.Join(", ", Properties.Select(p => p.Name + " = " + Word(p.GetValue(this)))) + " }";

        private static string Word(object? value)
        {
            if (value == null) return "null";
            object[]? list = Elements(value);
            if (value is double || value is float)
                return ((IFormattable)value).ToString("R", CultureInfo.InvariantCulture);
            if (list == null) return Convert.ToString(value, CultureInfo.InvariantCulture) ?? "";
            return "[" + string.Join(", ", list.Take(16).Select(Word)) + (list.Length > 16 ? ", ...]" : "]");
        }
    }
}
