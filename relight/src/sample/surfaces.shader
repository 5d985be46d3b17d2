// The materials of the built-in sample of surfaces that need a script; the others are their images under light.

surfaces/lamp_white
{
	surfaceparm nolightmap
	q3map_lightRGB 1 0.96 0.88
	q3map_surfacelight 8000
	{
		map surfaces/lamp_white.tga
	}
}

surfaces/lamp_warm
{
	surfaceparm nolightmap
	q3map_lightRGB 1 0.72 0.42
	q3map_surfacelight 9000
	{
		map surfaces/lamp_warm.tga
	}
}

surfaces/clear
{
	surfaceparm trans
	surfaceparm nolightmap
	cull none
	{
		map surfaces/pane.tga
		blendFunc blend
	}
}

surfaces/frosted
{
	surfaceparm trans
	surfaceparm nolightmap
	cull none
	{
		map surfaces/pane.tga
		blendFunc blend
	}
}
